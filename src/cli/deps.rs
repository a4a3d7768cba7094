//! What a compilation read and wrote, for build tools: a rule of make (which ninja reads too), JSON, or plain names.

use super::output::{self, DASH, Failure};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct Deps {
    /// Write what was read and made, for build tools.
    #[arg(long = "deps", value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// How that is written.
    #[arg(long = "deps-format", value_name = "FORMAT", default_value = "make", requires = "file")]
    pub format: DepsFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DepsFormat {
    /// A rule of make, also for `deps = gcc` of ninja.
    Make,
    /// An object with `outputs`, `inputs`, and `missing`: files that were looked for in vain.
    Json,
    /// The inputs, each followed by a zero byte.
    Zero,
}

/// A file that was read, or looked for, with the digest of what it held then; none if it was not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    pub path: PathBuf,
    pub held: Option<blake3::Hash>,
}

impl Input {
    /// The state of a file now.
    pub fn now(path: &Path) -> Input {
        Input { path: path.to_path_buf(), held: output::read_file(path).ok().map(|bytes| blake3::hash(&bytes)) }
    }
}

impl Deps {
    /// Fails now if the file could not be written later.
    pub fn probe(&self) -> Result<(), Failure> {
        self.file.iter().try_for_each(|file| output::probe(file))
    }

    /// Writes the file after a success. Standard input and output are no files.
    pub fn write(&self, outputs: &[PathBuf], inputs: &[Input]) -> Result<(), Failure> {
        let Some(file) = &self.file else { return Ok(()) };
        let outputs: Vec<&Path> = outputs.iter().map(PathBuf::as_path).filter(|p| *p != Path::new(DASH)).collect();
        let read = paths(inputs, true);
        let bytes = match self.format {
            DepsFormat::Make => make_rule(&outputs, &read)?.into_bytes(),
            DepsFormat::Json => json(&outputs, &read, &paths(inputs, false))?.into_bytes(),
            DepsFormat::Zero => zero(&read),
        };
        output::write(file, &bytes)
    }

    /// Writes what is known after a failure: nothing was made. A rule without a target says nothing, so the last one stays.
    pub fn write_failed(&self, inputs: &[Input]) -> Result<(), Failure> {
        if self.format == DepsFormat::Make { Ok(()) } else { self.write(&[], inputs) }
    }
}

/// The files that were there, or those that were not, each once.
fn paths(inputs: &[Input], there: bool) -> Vec<&Path> {
    let mut found: Vec<&Path> = Vec::new();
    for input in inputs.iter().filter(|i| i.held.is_some() == there) {
        if !found.contains(&input.path.as_path()) {
            found.push(&input.path);
        }
    }
    found
}

/// `targets: inputs`, and a rule without a recipe for every file that a spec uses, so that make does not stop when one is
/// taken away.
fn make_rule(targets: &[&Path], inputs: &[&Path]) -> Result<String, Failure> {
    let escaped = |paths: &[&Path]| paths.iter().map(|p| escaped(text(p)?)).collect::<Result<Vec<_>, _>>();
    let inputs = escaped(inputs)?;
    let used: String = inputs.iter().skip(1).map(|input| format!("\n{input}:\n")).collect();
    Ok(format!("{}: {}\n{used}", escaped(targets)?.join(" "), inputs.join(" ")))
}

/// A name as make and ninja read it back. Backslashes are themselves but before what they escape, where they are doubled.
fn escaped(name: &str) -> Result<String, Failure> {
    let mut out = String::new();
    let mut backslashes = 0;
    for letter in name.chars() {
        match letter {
            '\n' => return Err(Failure(format!("make knows no names with line breaks: {name:?}"))),
            ' ' | '\t' | '#' => out.extend(std::iter::repeat_n('\\', backslashes + 1)),
            '$' => out.push('$'),
            _ => {}
        }
        backslashes = if letter == '\\' { backslashes + 1 } else { 0 };
        out.push(letter);
    }
    Ok(out)
}

fn json(outputs: &[&Path], inputs: &[&Path], missing: &[&Path]) -> Result<String, Failure> {
    fn texts<'a>(paths: &[&'a Path]) -> Result<Vec<&'a str>, Failure> {
        paths.iter().map(|p| text(p)).collect()
    }
    let value = serde_json::json!({ "outputs": texts(outputs)?, "inputs": texts(inputs)?, "missing": texts(missing)? });
    Ok(format!("{value}\n"))
}

fn zero(inputs: &[&Path]) -> Vec<u8> {
    inputs.iter().flat_map(|path| [path.as_os_str().as_encoded_bytes(), b"\0"].concat()).collect()
}

fn text(path: &Path) -> Result<&str, Failure> {
    path.to_str().ok_or_else(|| Failure(format!("`{}` is not Unicode: write `--deps-format zero`", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn make_rules_escape_what_make_would_read() {
        let rule = make_rule(&[Path::new("a b.ron")], &[Path::new("x$y.gng"), Path::new("p#q.gng")]).unwrap();
        assert_eq!(rule, "a\\ b.ron: x$$y.gng p\\#q.gng\n\np\\#q.gng:\n");
        assert_eq!(escaped("a\\ b\\c").unwrap(), "a\\\\\\ b\\c");
        assert!(escaped("a\nb").is_err());
    }

    #[test]
    fn other_formats_hold_any_name() {
        let inputs = [Path::new("a \"b\n.gng"), Path::new("c.gng")];
        let value: serde_json::Value = serde_json::from_str(&json(&[], &inputs, &[Path::new("d")]).unwrap()).unwrap();
        assert_eq!(value, serde_json::json!({ "outputs": [], "inputs": ["a \"b\n.gng", "c.gng"], "missing": ["d"] }));
        assert_eq!(zero(&inputs), b"a \"b\n.gng\0c.gng\0");
    }

    #[test]
    fn files_are_named_once_and_missing_ones_apart() {
        let input = |name: &str, there: bool| Input { path: name.into(), held: there.then(|| blake3::hash(b"")) };
        let inputs = [input("a", true), input("b", false), input("a", true)];
        assert_eq!(paths(&inputs, true), [Path::new("a")]);
        assert_eq!(paths(&inputs, false), [Path::new("b")]);
    }
}
