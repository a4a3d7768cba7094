//! A spec beside its goldens: what it makes now, what is blessed, and the verdict on each file.

use super::is_json;
use super::json::{Counts, Said};
use crate::artifacts::{self, Artifact};
use crate::cli::args::{Global, GoldenArgs};
use crate::cli::compile::{self, Document};
use crate::cli::messages;
use crate::cli::output::{self, DASH, Failure};
use crate::golden::{self, Difference, Tolerances, pictures};
use crate::line::Stage;
use crate::{Compiled, Options};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// A spec with what it makes now and what is blessed, by file name: `contacts.ron`, `images/good.png`.
pub struct Case {
    pub spec: PathBuf,
    /// The spec's stem.
    pub name: String,
    pub folder: PathBuf,
    stages: BTreeSet<Artifact>,
    made: BTreeMap<String, Vec<u8>>,
    pub blessed: BTreeMap<String, Vec<u8>>,
}

/// What is to be said about one file.
pub enum Verdict {
    Equal,
    /// With the content that would be blessed.
    Differs(Vec<Difference>, Vec<u8>),
    Missing(Vec<u8>),
    /// Blessed once, and not made any more.
    Stale,
    /// The blessed file allows something that cannot be understood.
    Unclear(String),
}

impl Verdict {
    fn word(&self) -> &'static str {
        match self {
            Verdict::Equal => "equal",
            Verdict::Differs(..) => "differs",
            Verdict::Missing(_) => "missing",
            Verdict::Stale => "stale",
            Verdict::Unclear(_) => "unclear",
        }
    }
}

/// Each spec compiled as far as its goldens need; `None` for those with errors, which are reported.
pub fn cases(args: &GoldenArgs, global: &Global) -> Result<Vec<Option<Case>>, Failure> {
    let mut names = BTreeMap::new();
    for spec in &args.specs {
        let name = spec.file_stem().filter(|_| spec != Path::new(DASH));
        let name = name.ok_or_else(|| Failure(format!("`{}` names no golden: give a file", spec.display())))?;
        if let Some(other) = names.insert(name, spec) {
            let (spec, other) = (spec.display(), other.display());
            return Err(Failure(format!("`{other}` and `{spec}` would share their goldens: give each a --dir")));
        }
    }
    args.specs.iter().map(|spec| Case::new(spec, args, global)).collect()
}

impl Case {
    fn new(spec: &Path, args: &GoldenArgs, global: &Global) -> Result<Option<Case>, Failure> {
        let name = spec.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let folder = args.dir.join(&name);
        let blessed = blessed(&folder).map_err(|e| Failure::at(&folder, "read", &e))?;
        let stages = stages(args, &blessed);
        let document = Document::read(spec)?;
        let options = Options { wanted: stages.clone(), ..Options::default() };
        let compiled = args.jobs.run(|| compile::run(&document, &options, global))?;
        if compiled.diagnostics.iter().any(|d| d.is_error()) {
            messages::print(&compiled.diagnostics, &compiled.sources, global)?;
            return Ok(None);
        }
        let made = made(&compiled);
        Ok(Some(Case { spec: spec.into(), name, folder, stages, made, blessed }))
    }

    /// About every file of the stages in question, in the order of their names.
    pub fn verdicts(&self) -> Vec<(String, Verdict)> {
        let ours = |file: &&String| stage_of(file).is_some_and(|stage| self.stages.contains(&stage));
        let files: BTreeSet<&String> = self.made.keys().chain(self.blessed.keys()).filter(ours).collect();
        files.into_iter().map(|file| (file.clone(), self.verdict(file))).collect()
    }

    fn verdict(&self, file: &str) -> Verdict {
        match (self.blessed.get(file), self.made.get(file)) {
            (Some(_), None) | (None, None) => Verdict::Stale,
            (blessed, Some(now)) if is_picture(file) => self.picture(blessed.map(Vec::as_slice), now),
            (None, Some(now)) => {
                let head = golden::usual(file.trim_end_matches(".ron"));
                Verdict::Missing([head.as_bytes(), now].concat())
            }
            (Some(blessed), Some(now)) => text(file, &lossy(blessed), &lossy(now)),
        }
    }

    fn picture(&self, blessed: Option<&[u8]>, now: &[u8]) -> Verdict {
        let small = || pictures::reduced(now).unwrap_or_default();
        let Some(blessed) = blessed else { return Verdict::Missing(small()) };
        // What pictures may differ by stands in the text that lists them.
        let list = self.blessed.get(&Artifact::Images.file()).map(|text| lossy(text)).unwrap_or_default();
        let allowed = Tolerances::of(&list).unwrap_or_default().pictures;
        match pictures::difference(blessed, now, &allowed) {
            Some(difference) => Verdict::Differs(vec![difference], small()),
            None => Verdict::Equal,
        }
    }

    /// Names what lies among the goldens and belongs to no stage.
    pub fn tell_strangers(&self, global: &Global, counts: &mut Counts) -> Result<(), Failure> {
        for file in self.blessed.keys().filter(|file| stage_of(file).is_none()) {
            let golden = self.folder.join(file);
            if is_json(global) {
                counts.say(&Said { verdict: "stranger", ..self.said(&golden, file, &Verdict::Equal) })?;
            } else {
                output::remark(&format!("warning: {}: no stage writes this", golden.display()));
            }
        }
        Ok(())
    }

    /// What a program is told about a file, before anything is done about it.
    pub fn said<'a>(&'a self, golden: &'a Path, file: &str, verdict: &'a Verdict) -> Said<'a> {
        let (differences, why): (&[Difference], _) = match verdict {
            Verdict::Differs(differences, _) => (differences, None),
            Verdict::Unclear(why) => (&[], Some(why.as_str())),
            _ => (&[], None),
        };
        Said {
            spec: &self.spec,
            golden,
            stage: stage_of(file).map(|stage| stage.name()),
            verdict: verdict.word(),
            why,
            differences,
            kept: None,
            diff: None,
            done: None,
        }
    }

    /// The lines of a text that differ.
    pub fn diff(&self, golden: &Path, file: &str, content: &[u8]) -> Option<String> {
        let blessed = self.blessed.get(file).filter(|_| !is_picture(file))?;
        let (name, now) = (golden.display().to_string(), format!("{} (now)", golden.display()));
        Some(golden::unified(&name, &lossy(blessed), &now, &lossy(content)))
    }

    /// What to type to bless these stages.
    pub fn command(&self, stages: &BTreeSet<Artifact>, dir: &Path) -> String {
        let stages: Vec<&str> = stages.iter().map(|s| s.name()).collect();
        let dir = if dir == Path::new("golden") { String::new() } else { format!(" --dir {}", dir.display()) };
        format!("gonogo golden bless {} --stage {}{dir}", self.spec.display(), stages.join(","))
    }
}

fn text(file: &str, blessed: &str, now: &str) -> Verdict {
    let tolerances = match Tolerances::of(blessed) {
        Ok(tolerances) => tolerances,
        Err(unclear) => return Verdict::Unclear(unclear.to_string()),
    };
    let settled = golden::settle(file.trim_end_matches(".ron"), blessed, now, &tolerances);
    if settled.differences.is_empty() {
        return Verdict::Equal;
    }
    Verdict::Differs(settled.differences, (golden::head(blessed) + &settled.text).into_bytes())
}

/// The stages asked for: else those that need no rendering, and those that somebody blessed.
fn stages(args: &GoldenArgs, blessed: &BTreeMap<String, Vec<u8>>) -> BTreeSet<Artifact> {
    if !args.stages.is_empty() {
        return args.stages.iter().copied().collect();
    }
    let quick = |a: &Artifact| a.is_reviewed() && a.stage() <= Stage::View;
    Artifact::ALL.into_iter().filter(quick).chain(blessed.keys().filter_map(|file| stage_of(file))).collect()
}

/// The stage a golden belongs to.
pub fn stage_of(file: &str) -> Option<Artifact> {
    if is_picture(file) {
        return Some(Artifact::Images);
    }
    Artifact::ALL.into_iter().find(|a| a.is_reviewed() && a.file() == file)
}

const PICTURES: &str = "images/";

pub fn is_picture(file: &str) -> bool {
    file.starts_with(PICTURES) && file.ends_with(".png")
}

/// The texts of every stage and the pictures; drawings and data for other programs say the same in another form.
fn made(compiled: &Compiled) -> BTreeMap<String, Vec<u8>> {
    let mut made = BTreeMap::new();
    let mut pictures = Vec::new();
    for (name, bytes) in &compiled.artifacts {
        if is_picture(name) {
            pictures.push((name[PICTURES.len()..].to_string(), bytes.clone()));
            made.insert(name.clone(), bytes.clone());
        } else if name.ends_with(".ron") && !says_nothing(bytes) {
            made.insert(name.clone(), bytes.clone());
        }
    }
    if !pictures.is_empty() {
        made.insert(Artifact::Images.file(), pictures::summary(&pictures).into_bytes());
    }
    if let Some(model) = &compiled.model {
        made.insert(Artifact::Model.file(), artifacts::model_summary(model).into_bytes());
    }
    made
}

/// A list of nothing: the measures of a spec that measures nothing.
fn says_nothing(bytes: &[u8]) -> bool {
    lossy(bytes).lines().filter(|l| !l.starts_with("//")).eq(["[]"])
}

/// Every file of a folder of goldens but those that are kept beside them; nothing if there is no such folder.
fn blessed(folder: &Path) -> io::Result<BTreeMap<String, Vec<u8>>> {
    let mut found = BTreeMap::new();
    for prefix in ["", PICTURES] {
        let entries = match fs::read_dir(folder.join(prefix)) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let kept = [".now.", ".diff."].iter().any(|mark| name.contains(mark));
            if entry.file_type()?.is_file() && !name.starts_with('.') && !kept {
                found.insert(format!("{prefix}{name}"), fs::read(entry.path())?);
            }
        }
    }
    Ok(found)
}

pub fn lossy(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
