//! `gonogo std`: what the parts library has.
//!
//! In: nothing, or the name of a file or a family. Out: the families with their sizes, one file a paragraph or a JSON object
//! a line; or the text of a file. All of it is read from the files themselves.

use super::Exit;
use super::args::{Global, MessageFormat};
use super::output::{self, Failure};
use crate::design::library;
use crate::syntax::ast::{Body, File, Gap, Stmt};
use clap::{Args, Subcommand};
use serde_json::{Value, json};

#[derive(Debug, Subcommand)]
pub enum Std {
    /// List the families of the parts library with their sizes.
    List,
    /// Print a file of the library: `gonogo std show iso4762`.
    Show(Show),
}

#[derive(Debug, Args)]
pub struct Show {
    /// `iso4762`, `std/iso4762`, or a family.
    pub name: String,
}

pub fn std(command: &Std, global: &Global) -> Result<Exit, Failure> {
    match command {
        Std::List if global.message_format == MessageFormat::Json => {
            shelf().try_for_each(|shelf| output::line(&shelf.json().to_string()))?;
        }
        Std::List => shelf().try_for_each(|shelf| shelf.lines().iter().try_for_each(|line| output::line(line)))?,
        Std::Show(show) => output::line(text(&show.name)?.trim_end())?,
    }
    Ok(Exit::Fine)
}

/// The text of a file, by its name with or without `std/`, or by a family it draws.
fn text(name: &str) -> Result<&'static str, Failure> {
    let full = if library::is_meant(name) { name.to_string() } else { format!("std/{name}") };
    let found = library::text(&full).or_else(|| library::text(library::home_of(name)?));
    found.ok_or_else(|| {
        let near = library::nearest_file(&full).map(|near| format!("did you mean `{near}`?"));
        let help = near.unwrap_or_else(|| "`gonogo std list` lists all".to_string());
        Failure(format!("the parts library has no `{name}`; {help}"))
    })
}

/// A file of the library.
struct Shelf {
    /// As behind `use`.
    name: &'static str,
    /// The first sentence of the file.
    title: String,
    families: Vec<Family>,
    materials: Vec<String>,
}

struct Family {
    name: String,
    /// Parameters with their sizes; one without any takes every length.
    parameters: Vec<(String, Vec<String>)>,
}

fn shelf() -> impl Iterator<Item = Shelf> {
    library::files().map(|(name, text)| {
        let (file, _) = crate::syntax::parse(text, 0);
        let families = file.lines.iter().filter_map(|line| match &line.stmt {
            Stmt::Family { name, params, body } => {
                let sized = |param: &crate::syntax::ast::Name| (param.text.clone(), sizes(body, &param.text));
                Some(Family { name: name.text.clone(), parameters: params.iter().map(sized).collect() })
            }
            _ => None,
        });
        let materials = file.lines.iter().filter_map(|line| match &line.stmt {
            Stmt::Material { name, .. } => Some(name.text.clone()),
            _ => None,
        });
        Shelf { name, title: title(&file), families: families.collect(), materials: materials.collect() }
    })
}

/// The first sentence of the first comment.
fn title(file: &File) -> String {
    let gaps = file.lines.iter().flat_map(|line| &line.before);
    let words = gaps.filter_map(|gap| match gap {
        Gap::Comment(text) => Some(text.trim_start_matches('/').trim()),
        Gap::Blank => None,
    });
    let text = words.take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
    text.split(". ").next().unwrap_or_default().trim_end_matches('.').to_string()
}

/// The sizes that a table of a family gives to a parameter.
fn sizes(body: &Body, param: &str) -> Vec<String> {
    let rows = body.lines.iter().find_map(|line| match &line.stmt {
        Stmt::Table { name, body, .. } if name.text == param => Some(&body.lines),
        _ => None,
    });
    let key = |line: &crate::syntax::ast::Line| match &line.stmt {
        Stmt::Row { key, .. } => Some(key.text.clone()),
        _ => None,
    };
    rows.map_or_else(Vec::new, |rows| rows.iter().filter_map(key).collect())
}

impl Shelf {
    fn lines(&self) -> Vec<String> {
        let mut lines = vec![format!("{}: {}", self.name, self.title)];
        for Family { name, parameters } in &self.families {
            let names: Vec<&str> = parameters.iter().map(|(param, _)| param.as_str()).collect();
            lines.push(format!("  {name}({})", names.join(", ")));
            lines.extend(parameters.iter().map(|(param, sizes)| match sizes.is_empty() {
                true => format!("    {param} = any length"),
                false => format!("    {param} = {}", sizes.join(" ")),
            }));
        }
        lines.extend(self.materials.iter().map(|name| format!("  material {name}")));
        lines
    }

    fn json(&self) -> Value {
        let family = |Family { name, parameters }: &Family| {
            let parameter = |(param, sizes): &(String, Vec<String>)| json!({ "name": param, "sizes": sizes });
            json!({ "name": name, "parameters": parameters.iter().map(parameter).collect::<Vec<_>>() })
        };
        json!({
            "use": self.name,
            "title": self.title,
            "families": self.families.iter().map(family).collect::<Vec<_>>(),
            "materials": self.materials,
        })
    }
}
