//! What a person is told about a golden, and the new output kept where they can look at it.

use super::case::{Case, Verdict, is_picture, lossy};
use super::is_json;
use super::json::{Counts, Said};
use crate::cli::args::{Colour, Global, GoldenArgs};
use crate::cli::output::{self, Failure};
use crate::golden::{self, Difference, pictures};
use std::fs;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

/// Prints what is to be said about a file and keeps what it should be; whether it is at fault.
pub fn told(
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
pub fn summed(differences: &[Difference]) -> String {
    let first = differences.first().map(Difference::to_string).unwrap_or_default();
    match differences.len() {
        0 | 1 => first,
        more => format!("{first}; and {} more", more - 1),
    }
}

/// `contacts.now.ron`
pub fn marked(path: &Path, mark: &str) -> PathBuf {
    let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    path.with_extension(format!("{mark}.{extension}"))
}

/// All that differs: lines of a text, or a picture of the pictures.
pub fn show(
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
