//! What can be said on the command line.

use super::deps::{Deps, DepsFormat};
use super::keep::Keeping;
use super::library::Std;
use super::messages::levels;
use super::output::Failure;
use super::shells::{Completions, Man};
use super::watch::Watch;
use crate::artifacts::Artifact;
use crate::diag::Diagnostic;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Compiles a text file that describes an assembly into an inspector for it.
#[derive(Debug, Parser)]
#[command(name = "gonogo", version, propagate_version = true, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub global: Global,
}

#[derive(Debug, Args)]
pub struct Global {
    /// When to use colour.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub color: Colour,
    /// How diagnostics are written.
    #[arg(long, global = true, value_name = "FORMAT", default_value = "human")]
    pub message_format: MessageFormat,
    /// Print the time every stage, or every part of judging, took.
    #[arg(long, global = true)]
    pub timings: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Colour {
    Auto,
    Always,
    Never,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MessageFormat {
    /// With the source, for people.
    Human,
    /// One line each.
    Short,
    /// One JSON object a line.
    Json,
    /// Annotations of GitHub Actions.
    Github,
    /// One SARIF 2.1.0 log, for code scanners.
    Sarif,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compile a spec into an inspection model.
    Compile(Compile),
    /// Check specs without rendering anything.
    Check(Check),
    /// Lay out specs in the one canonical way.
    Fmt(Fmt),
    /// Fit a model to its station by photos of correct assemblies.
    Calibrate(Calibrate),
    /// Judge photos: exit code 0 all go, 1 any no-go, 2 any that could not be judged.
    Inspect(Inspect),
    /// Write a page that shows the assembly in 3-D, what can be told about it, and judged photos.
    Report(Report),
    /// Hold a model's promise against fresh renders.
    Prove(Prove),
    /// Explain a diagnostic: `gonogo explain E0305`.
    Explain(Explain),
    /// Compare the outputs of the stages with blessed ones, or bless them.
    #[command(subcommand)]
    Golden(Golden),
    /// Turn an OpenSCAD design (`openscad -o part.csg part.scad`) into a part with general tolerances.
    Import(Import),
    /// What the parts library has: `gonogo std list`.
    #[command(subcommand)]
    Std(Std),
    /// Compile the pattern wheel, calibrate it, and judge the photos that come with it.
    Demo(Demo),
    /// Serve editors: the Language Server Protocol on standard input and output.
    Lsp(Lsp),
    /// Print a script that completes commands and options in a shell.
    Completions(Completions),
    /// Write the manual pages.
    Man(Man),
}

#[derive(Debug, Args)]
pub struct Lsp {
    /// The only way there is; editors say so by custom.
    #[arg(long)]
    pub stdio: bool,
}

#[derive(Debug, Args)]
pub struct Variant {
    /// Replace the value of a `let`; later wins.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment, action = ArgAction::Append)]
    pub set: Vec<(String, String)>,
    /// Treat a warning as an error: `-D W0304`, or `-D warnings` for all.
    #[arg(short = 'D', long = "deny", value_name = "CODE", value_parser = levels::denied, action = ArgAction::Append)]
    pub deny: Vec<String>,
    /// Leave a warning out: `--allow W0310`, also under `-D warnings`.
    #[arg(long, value_name = "CODE", value_parser = levels::warning, action = ArgAction::Append)]
    pub allow: Vec<String>,
}

#[derive(Debug, Args)]
pub struct Jobs {
    /// Threads to use; the result is the same for any number. Default: one per core.
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
}

#[derive(Debug, Args)]
pub struct Compile {
    /// The spec, or `-` for standard input.
    pub spec: PathBuf,
    /// The station the model is for, with all of its cameras; the first of the spec unless given.
    #[arg(long, value_name = "NAME")]
    pub station: Option<String>,
    /// Where the model goes: `NAME.model.ron` in the current folder unless given.
    #[arg(short, long, value_name = "MODEL")]
    pub output: Option<PathBuf>,
    /// Write the outputs of these stages; the model itself only if it is among them or `-o` is given.
    #[arg(long, value_name = "STAGE,…", value_delimiter = ',', value_parser = stages())]
    pub emit: Vec<Artifact>,
    #[command(flatten)]
    pub deps: Deps,
    /// Fail if the compiler would have to choose anything that `NAME.lock.ron` beside the spec does not hold.
    #[arg(long)]
    pub locked: bool,
    #[command(flatten)]
    pub keeping: Keeping,
    #[command(flatten)]
    pub watch: Watch,
    #[command(flatten)]
    pub variant: Variant,
    #[command(flatten)]
    pub jobs: Jobs,
}

#[derive(Debug, Args)]
pub struct Check {
    /// The specs, or `-` for standard input.
    #[arg(required = true)]
    pub specs: Vec<PathBuf>,
    /// Mend in these specs what can mean only one thing, then check what is left; `-` goes to standard output.
    #[arg(long)]
    pub fix: bool,
    #[command(flatten)]
    pub variant: Variant,
    /// Write this empty file if all is fine: something for a build tool to look at.
    #[arg(long, value_name = "FILE")]
    pub stamp: Option<PathBuf>,
    #[command(flatten)]
    pub deps: Deps,
    #[command(flatten)]
    pub watch: Watch,
}

#[derive(Debug, Args)]
pub struct Fmt {
    /// Change nothing; exit with 1 if a spec is laid out otherwise.
    #[arg(long)]
    pub check: bool,
    /// Change nothing; show what would change, exit with 1 if anything would.
    #[arg(long)]
    pub diff: bool,
    /// The specs, or `-` for standard input to standard output.
    #[arg(required = true)]
    pub specs: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub struct Calibrate {
    pub model: PathBuf,
    /// Photos of correct assemblies; one is enough. Of several cameras one each: `top=PHOTO side=PHOTO`.
    #[arg(required = true)]
    pub photos: Vec<PathBuf>,
    /// Where the calibration goes.
    #[arg(short, long, value_name = "CALIBRATION", required = true)]
    pub output: PathBuf,
}

#[derive(Debug, Args)]
pub struct Inspect {
    pub model: PathBuf,
    /// Photos, folders of photos, or `-` for standard input: an image, or the names of photos, one a line. Of several cameras
    /// one each: `top=PHOTO side=PHOTO`.
    #[arg(value_name = "PHOTO", required_unless_present = "watch")]
    pub photos: Vec<PathBuf>,
    /// After these, judge every photo that appears in DIR, once it is completely written.
    #[arg(long, value_name = "DIR")]
    pub watch: Option<PathBuf>,
    /// Stop watching after so many photos.
    #[arg(long, value_name = "N", requires = "watch")]
    pub for_count: Option<u64>,
    /// Stop watching when this file exists and all photos that were there are judged.
    #[arg(long, value_name = "FILE", requires = "watch")]
    pub until: Option<PathBuf>,
    /// The station's calibration; without it the lamps and the camera are taken to be as the spec says.
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<PathBuf>,
    /// How verdicts are written.
    #[arg(long, value_name = "FORMAT", default_value = "human")]
    pub format: VerdictFormat,
    /// Write every photo with what was found drawn over it, as `DIR/<photo>.png`.
    #[arg(long, value_name = "DIR")]
    pub overlay: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum VerdictFormat {
    Human,
    /// One JSON object a line and photo.
    Json,
    /// One report: a suite a photo, a test case a watched component.
    Junit,
}

#[derive(Debug, Args)]
pub struct Report {
    /// The spec, or `-` for standard input.
    pub spec: PathBuf,
    /// Photos to judge with the model; they need `--model`.
    #[arg(requires = "model")]
    pub photos: Vec<PathBuf>,
    /// The station to show: the model's, or the first of the spec, unless given.
    #[arg(long, value_name = "NAME")]
    pub station: Option<String>,
    /// The model compiled from the spec: adds what it promises, its templates, and verdicts on photos.
    #[arg(long, value_name = "MODEL")]
    pub model: Option<PathBuf>,
    /// What `gonogo calibrate` wrote. Without it, camera and lamps are taken to be as the spec says.
    #[arg(long, value_name = "FILE", requires = "model")]
    pub calibration: Option<PathBuf>,
    /// The runtime for browsers (`tools/wasm.sh` makes it): the page then judges photos that are dropped on it. It carries module
    /// and model, so it has a third more bytes than they.
    #[arg(long, value_name = "WASM", requires = "model")]
    pub judge: Option<PathBuf>,
    /// Where the page goes: one HTML file that needs no other.
    #[arg(short, long, value_name = "PAGE", default_value = "report.html")]
    pub output: PathBuf,
    #[command(flatten)]
    pub variant: Variant,
    #[command(flatten)]
    pub jobs: Jobs,
}

#[derive(Debug, Args)]
pub struct Prove {
    /// The spec, or `-` for standard input.
    pub spec: PathBuf,
    /// The model compiled from it; it names the station.
    #[arg(long, value_name = "MODEL")]
    pub model: PathBuf,
    /// Good assemblies to render.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub goods: u32,
    /// Assemblies to render with each error mode.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    pub faults: u32,
    /// Stations among which they are shared, each installed and lit in its own way and calibrated with one photo.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub customers: u32,
    #[command(flatten)]
    pub variant: Variant,
    #[command(flatten)]
    pub jobs: Jobs,
}

#[derive(Debug, Args)]
pub struct Explain {
    /// `E0305`; all codes unless given.
    pub code: Option<String>,
}

#[derive(Debug, Subcommand)]
pub enum Golden {
    /// Compare; exit code 1 if anything differs, is missing or is not made any more.
    Check(GoldenCheck),
    /// Rewrite the blessed outputs that differ, and say what changes. Refused when CI is set.
    Bless(GoldenBless),
}

#[derive(Debug, Args)]
pub struct GoldenArgs {
    #[arg(required = true)]
    pub specs: Vec<PathBuf>,
    /// The folder of blessed outputs, one folder a spec in it.
    #[arg(long, value_name = "DIR", default_value = "golden")]
    pub dir: PathBuf,
    /// The stages to compare. Default: all that need no rendering, and those that were blessed.
    #[arg(long = "stage", visible_alias = "stages", value_name = "STAGE,…", value_delimiter = ',',
          value_parser = reviewed_stages())]
    pub stages: Vec<Artifact>,
    /// Print all that differs as a unified diff.
    #[arg(long)]
    pub diff: bool,
    #[command(flatten)]
    pub jobs: Jobs,
}

#[derive(Debug, Args)]
pub struct GoldenCheck {
    #[command(flatten)]
    pub golden: GoldenArgs,
    /// Where outputs that differ are kept.
    #[arg(long, value_name = "DIR", default_value = "target/golden")]
    pub keep: PathBuf,
    /// Keep outputs that differ beside the blessed ones instead, as `contacts.now.ron`.
    #[arg(long, conflicts_with = "keep")]
    pub beside: bool,
}

#[derive(Debug, Args)]
pub struct GoldenBless {
    #[command(flatten)]
    pub golden: GoldenArgs,
    /// Say what would change and change nothing.
    #[arg(long)]
    pub dry_run: bool,
}

#[derive(Debug, Args)]
pub struct Import {
    /// The design as OpenSCAD's `.csg`, or `-` for standard input.
    pub design: PathBuf,
    /// Where the part goes; standard output unless given.
    #[arg(short, long, value_name = "SPEC")]
    pub output: Option<PathBuf>,
    /// What the part is called; like its file unless given.
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
}

#[derive(Debug, Args)]
pub struct Demo {
    /// Where the model, the calibration and the overlays go.
    #[arg(long, value_name = "DIR", default_value = "target/demo")]
    pub out: PathBuf,
    #[command(flatten)]
    pub jobs: Jobs,
}

fn stages() -> impl TypedValueParser<Value = Artifact> {
    among(|_| true)
}

/// The stages whose outputs people review.
fn reviewed_stages() -> impl TypedValueParser<Value = Artifact> {
    among(Artifact::is_reviewed)
}

fn among(counts: fn(Artifact) -> bool) -> impl TypedValueParser<Value = Artifact> {
    let names = Artifact::ALL.iter().filter(|s| counts(**s)).map(|s| s.name());
    PossibleValuesParser::new(names).try_map(|s| Artifact::named(&s).ok_or("no such stage"))
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    if name.trim().is_empty() || value.trim().is_empty() {
        return Err("expected NAME=VALUE".into());
    }
    Ok((name.trim().into(), value.trim().into()))
}

impl Check {
    /// A rule of make is about a target, and what a check makes is its stamp.
    pub fn refuse_rule_without_target(&self) -> Result<(), Failure> {
        let is_rule = self.deps.file.is_some() && self.deps.format == DepsFormat::Make;
        match is_rule && self.stamp.is_none() {
            true => {
                Err(Failure("a rule of make needs a target: give `--stamp FILE`, or another `--deps-format`".into()))
            }
            false => Ok(()),
        }
    }
}

impl Variant {
    /// The diagnostics with allowed warnings left out and denied ones as errors.
    pub fn judged(&self, diagnostics: &[Diagnostic]) -> Vec<Diagnostic> {
        levels::applied(diagnostics, &self.deny, &self.allow)
    }
}

impl Jobs {
    /// Runs `work` on that many threads.
    pub fn run<T: Send>(&self, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
        let threads = usize::from(self.jobs.unwrap_or(0));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| Failure(format!("cannot start {threads} threads: {e}")))?;
        Ok(pool.install(work))
    }
}
