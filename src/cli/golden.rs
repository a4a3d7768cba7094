//! `gonogo golden`: the outputs of the stages against blessed ones.
//!
//! In: specs, and a folder with a folder of goldens for each. Out: what differs, what is missing and what is not made any
//! more; with `bless`, new goldens. What counts as different is decided in [`crate::golden`].

use super::args::{Colour, Global, GoldenArgs, GoldenBless, GoldenCheck, MessageFormat};
use super::compile::{self, Document};
use super::golden_json::{Counts, Said};
use super::output::{self, DASH, Failure};
use super::{Exit, messages};
use crate::artifacts::{self, Artifact};
use crate::golden::{self, Difference, LARGEST, Tolerances, pictures};
use crate::line::Stage;
use crate::{Compiled, Options};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Compares. What differs is kept, named and told apart from what is missing.
pub fn check(args: &GoldenCheck, global: &Global) -> Result<Exit, Failure> {
    let mut exit = Exit::Fine;
    let mut counts = Counts::default();
    let (mut faulty_specs, mut commands) = (0, Vec::new());
    for case in cases(&args.golden, global)? {
        let Some(case) = case else {
            exit = Exit::Faults;
            faulty_specs += 1;
            continue;
        };
        let verdicts = case.verdicts();
        let keep = (!args.beside).then(|| args.keep.join(&case.name));
        let mut faulty = BTreeSet::new();
        for (file, verdict) in &verdicts {
            if told(&case, file, verdict, &args.golden, keep.as_deref(), global, &mut counts)? {
                faulty.extend(stage_of(file));
            }
        }
        case.tell_strangers(global, &mut counts)?;
        if is_json(global) {
            commands.extend((!faulty.is_empty()).then(|| case.command(&faulty, &args.golden.dir)));
        } else if faulty.is_empty() {
            let agree = if verdicts.len() == 1 {
                "1 golden agrees".into()
            } else {
                format!("{} goldens agree", verdicts.len())
            };
            output::line(&format!("{}: {agree}", case.folder.display()))?;
        } else {
            output::remark(&format!("  to bless what is right: {}", case.command(&faulty, &args.golden.dir)));
        }
        if !faulty.is_empty() {
            exit = Exit::Faults;
        }
    }
    if is_json(global) {
        counts.finish(&[("faulty_specs", json!(faulty_specs)), ("bless", json!(commands))])?;
    }
    Ok(exit)
}

fn is_json(global: &Global) -> bool {
    global.message_format == MessageFormat::Json
}

/// Rewrites the blessed outputs that differ, all of them or none.
pub fn bless(args: &GoldenBless, global: &Global) -> Result<Exit, Failure> {
    if !args.dry_run && std::env::var_os("CI").is_some_and(|v| !v.is_empty()) {
        return Err(Failure("goldens are not blessed where CI is set: people review them".into()));
    }
    let cases = cases(&args.golden, global)?;
    let mut exit = Exit::Fine;
    let (mut changes, mut counts) = (Vec::new(), Counts::default());
    for case in &cases {
        let Some(case) = case else {
            exit = Exit::Faults;
            continue;
        };
        for (file, verdict) in case.verdicts() {
            if let Verdict::Unclear(why) = &verdict {
                output::remark(&format!("error: {}: {why}", case.folder.join(&file).display()));
                exit = Exit::Faults;
            }
            changes.push(Change { path: case.folder.join(&file), file, case, verdict });
        }
        case.tell_strangers(global, &mut counts)?;
    }
    if exit != Exit::Fine {
        output::remark("nothing was blessed");
        return Ok(exit);
    }
    let contents = changes.iter().map(Change::content).collect::<Result<Vec<_>, Failure>>()?;
    let mut tally = Tally::default();
    for (change, content) in changes.iter().zip(contents) {
        if is_json(global) {
            counts.say(&change.said(&mut tally, &args.golden))?;
        } else {
            change.tell(&mut tally, &args.golden, global)?;
        }
        if !args.dry_run {
            change.make(content)?;
        }
    }
    if is_json(global) {
        let Tally { blessed, removed, unchanged } = tally;
        let done = [("blessed", blessed), ("removed", removed), ("unchanged", unchanged)];
        let mut more: Vec<_> = done.map(|(key, count)| (key, json!(count))).into();
        more.push(("dry_run", json!(args.dry_run)));
        counts.finish(&more)?;
    } else {
        output::line(&tally.line(args.dry_run))?;
    }
    Ok(Exit::Fine)
}

/// A spec with what it makes now and what is blessed, by file name: `contacts.ron`, `images/good.png`.
struct Case {
    spec: PathBuf,
    /// The spec's stem.
    name: String,
    folder: PathBuf,
    stages: BTreeSet<Artifact>,
    made: BTreeMap<String, Vec<u8>>,
    blessed: BTreeMap<String, Vec<u8>>,
}

/// What is to be said about one file.
enum Verdict {
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
fn cases(args: &GoldenArgs, global: &Global) -> Result<Vec<Option<Case>>, Failure> {
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
    fn verdicts(&self) -> Vec<(String, Verdict)> {
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
    fn tell_strangers(&self, global: &Global, counts: &mut Counts) -> Result<(), Failure> {
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
    fn said<'a>(&'a self, golden: &'a Path, file: &str, verdict: &'a Verdict) -> Said<'a> {
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
    fn diff(&self, golden: &Path, file: &str, content: &[u8]) -> Option<String> {
        let blessed = self.blessed.get(file).filter(|_| !is_picture(file))?;
        let (name, now) = (golden.display().to_string(), format!("{} (now)", golden.display()));
        Some(golden::unified(&name, &lossy(blessed), &now, &lossy(content)))
    }

    /// What to type to bless these stages.
    fn command(&self, stages: &BTreeSet<Artifact>, dir: &Path) -> String {
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
fn stage_of(file: &str) -> Option<Artifact> {
    if is_picture(file) {
        return Some(Artifact::Images);
    }
    Artifact::ALL.into_iter().find(|a| a.is_reviewed() && a.file() == file)
}

const PICTURES: &str = "images/";

fn is_picture(file: &str) -> bool {
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

fn lossy(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Prints what is to be said about a file and keeps what it should be; whether it is at fault.
fn told(
    case: &Case,
    file: &str,
    verdict: &Verdict,
    args: &GoldenArgs,
    keep: Option<&Path>,
    global: &Global,
    counts: &mut Counts,
) -> Result<bool, Failure> {
    let golden = case.folder.join(file);
    let kept = keep.map_or_else(|| marked(&golden, "now"), |keep| keep.join(file));
    let for_people = !is_json(global);
    let say = |what: &str| {
        if for_people {
            output::remark(&format!("error: {}: {what}", golden.display()));
        }
    };
    let content = match verdict {
        Verdict::Equal => None,
        Verdict::Differs(differences, content) => {
            say(&summed(differences));
            Some(content)
        }
        Verdict::Missing(content) => {
            say("no blessed output to compare with");
            Some(content)
        }
        Verdict::Stale => {
            say("stale: this is not made any more");
            None
        }
        Verdict::Unclear(why) => {
            say(why);
            None
        }
    };
    let Some(content) = content else {
        // What an earlier run kept would mislead now.
        let _ = fs::remove_file(&kept);
        let _ = fs::remove_file(marked(&kept, "diff"));
        if !for_people {
            counts.say(&case.said(&golden, file, verdict))?;
        }
        return Ok(!matches!(verdict, Verdict::Equal));
    };
    output::make_dir(kept.parent().unwrap_or(Path::new(".")))?;
    output::write(&kept, content)?;
    if !for_people {
        let diff = args.diff.then(|| case.diff(&golden, file, content)).flatten();
        counts.say(&Said { kept: Some(&kept), diff, ..case.said(&golden, file, verdict) })?;
        return Ok(true);
    }
    output::remark(&format!("  the new output is {}", kept.display()));
    if let (true, Some(blessed)) = (args.diff, case.blessed.get(file)) {
        show(file, &golden, blessed, content, Some(&kept), global)?;
    }
    Ok(true)
}

/// The first difference, and how many there are behind it.
fn summed(differences: &[Difference]) -> String {
    let first = differences.first().map(Difference::to_string).unwrap_or_default();
    match differences.len() {
        0 | 1 => first,
        more => format!("{first}; and {} more", more - 1),
    }
}

/// `contacts.now.ron`
fn marked(path: &Path, mark: &str) -> PathBuf {
    let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    path.with_extension(format!("{mark}.{extension}"))
}

/// All that differs: lines of a text, or a picture of the pictures.
fn show(
    file: &str,
    golden: &Path,
    blessed: &[u8],
    content: &[u8],
    kept: Option<&Path>,
    global: &Global,
) -> Result<(), Failure> {
    if !is_picture(file) {
        let (name, now) = (golden.display().to_string(), format!("{} (now)", golden.display()));
        let diff = golden::unified(&name, &lossy(blessed), &now, &lossy(content));
        return output::line(coloured(&diff, has_colour(global)).trim_end_matches('\n'));
    }
    if let (Some(kept), Some(sheet)) = (kept, pictures::beside(blessed, content)) {
        let path = marked(kept, "diff");
        output::write(&path, &sheet)?;
        output::remark(&format!("  blessed, now, and 8 times their difference: {}", path.display()));
    }
    Ok(())
}

fn has_colour(global: &Global) -> bool {
    match global.color {
        Colour::Always => true,
        Colour::Never => false,
        Colour::Auto => io::stdout().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty()),
    }
}

fn coloured(diff: &str, colour: bool) -> String {
    if !colour {
        return diff.into();
    }
    let line = |line: &str| match line.bytes().next() {
        Some(b'-') => format!("\x1b[31m{line}\x1b[0m\n"),
        Some(b'+') => format!("\x1b[32m{line}\x1b[0m\n"),
        Some(b'@') => format!("\x1b[36m{line}\x1b[0m\n"),
        _ => format!("{line}\n"),
    };
    diff.lines().map(line).collect()
}

/// What `bless` does about a file.
struct Change<'a> {
    case: &'a Case,
    file: String,
    path: PathBuf,
    verdict: Verdict,
}

#[derive(Default)]
struct Tally {
    blessed: usize,
    removed: usize,
    unchanged: usize,
}

impl Tally {
    fn line(&self, dry: bool) -> String {
        let would = if dry { "would be " } else { "" };
        let Tally { blessed, removed, unchanged } = self;
        format!("{blessed} {would}blessed, {removed} {would}removed, {unchanged} unchanged")
    }
}

impl Tally {
    fn count(&mut self, what: &'static str) -> &'static str {
        match what {
            "blessed" => self.blessed += 1,
            "removed" => self.removed += 1,
            _ => self.unchanged += 1,
        }
        what
    }
}

impl Change<'_> {
    /// What will be in the file; `None` where nothing is written.
    fn content(&self) -> Result<Option<&[u8]>, Failure> {
        let (Verdict::Differs(_, content) | Verdict::Missing(content)) = &self.verdict else { return Ok(None) };
        if content.is_empty() || content.len() > LARGEST {
            let (path, length) = (self.path.display(), content.len());
            return Err(Failure(format!(
                "`{path}` would have {length} bytes, and nobody reviews more than {LARGEST}: leave that stage out (--stage)"
            )));
        }
        Ok(Some(content))
    }

    fn tell(&self, tally: &mut Tally, args: &GoldenArgs, global: &Global) -> Result<(), Failure> {
        let path = self.path.display();
        match &self.verdict {
            Verdict::Equal | Verdict::Unclear(_) => tally.unchanged += 1,
            Verdict::Missing(_) => {
                tally.blessed += 1;
                output::line(&format!("{path}: new"))?;
            }
            Verdict::Stale => {
                tally.removed += 1;
                output::line(&format!("{path}: removed, it is not made any more"))?;
            }
            Verdict::Differs(differences, content) => {
                tally.blessed += 1;
                output::line(&format!("{path}: {}", summed(differences)))?;
                if let (true, Some(blessed)) = (args.diff, self.case.blessed.get(&self.file)) {
                    show(&self.file, &self.path, blessed, content, None, global)?;
                }
            }
        }
        Ok(())
    }

    /// The same for programs.
    fn said(&self, tally: &mut Tally, args: &GoldenArgs) -> Said<'_> {
        let said = self.case.said(&self.path, &self.file, &self.verdict);
        let (done, content) = match &self.verdict {
            Verdict::Equal | Verdict::Unclear(_) => (tally.count("unchanged"), None),
            Verdict::Stale => (tally.count("removed"), None),
            Verdict::Missing(content) | Verdict::Differs(_, content) => (tally.count("blessed"), Some(content)),
        };
        let diff = content.filter(|_| args.diff).and_then(|content| self.case.diff(&self.path, &self.file, content));
        Said { done: Some(done), diff, ..said }
    }

    fn make(&self, content: Option<&[u8]>) -> Result<(), Failure> {
        let _ = fs::remove_file(marked(&self.path, "now"));
        let _ = fs::remove_file(marked(&marked(&self.path, "now"), "diff"));
        if let Some(content) = content {
            output::make_dir(self.path.parent().unwrap_or(Path::new(".")))?;
            return output::write(&self.path, content);
        }
        match &self.verdict {
            Verdict::Stale => fs::remove_file(&self.path).map_err(|e| Failure::at(&self.path, "remove", &e)),
            _ => Ok(()),
        }
    }
}
