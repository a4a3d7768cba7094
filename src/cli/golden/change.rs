//! What `gonogo golden bless` does about one file, and the count of what it did.

use super::case::{Case, Verdict};
use super::json::Said;
use super::tell::{marked, show, summed};
use crate::cli::args::{Global, GoldenArgs};
use crate::cli::output::{self, Failure};
use crate::golden::LARGEST;
use std::fs;
use std::path::{Path, PathBuf};

/// What `bless` does about a file.
pub struct Change<'a> {
    pub case: &'a Case,
    pub file: String,
    pub path: PathBuf,
    pub verdict: Verdict,
}

#[derive(Default)]
pub struct Tally {
    pub blessed: usize,
    pub removed: usize,
    pub unchanged: usize,
}

impl Tally {
    pub fn line(&self, dry: bool) -> String {
        let would = if dry { "would be " } else { "" };
        let Tally { blessed, removed, unchanged } = self;
        format!("{blessed} {would}blessed, {removed} {would}removed, {unchanged} unchanged")
    }

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
    pub fn content(&self) -> Result<Option<&[u8]>, Failure> {
        let (Verdict::Differs(_, content) | Verdict::Missing(content)) = &self.verdict else { return Ok(None) };
        if content.is_empty() || content.len() > LARGEST {
            let (path, length) = (self.path.display(), content.len());
            return Err(Failure(format!(
                "`{path}` would have {length} bytes, and nobody reviews more than {LARGEST}: leave that stage out (--stage)"
            )));
        }
        Ok(Some(content))
    }

    pub fn tell(&self, tally: &mut Tally, args: &GoldenArgs, global: &Global) -> Result<(), Failure> {
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
    pub fn said(&self, tally: &mut Tally, args: &GoldenArgs) -> Said<'_> {
        let said = self.case.said(&self.path, &self.file, &self.verdict);
        let (done, content) = match &self.verdict {
            Verdict::Equal | Verdict::Unclear(_) => (tally.count("unchanged"), None),
            Verdict::Stale => (tally.count("removed"), None),
            Verdict::Missing(content) | Verdict::Differs(_, content) => (tally.count("blessed"), Some(content)),
        };
        let diff = content.filter(|_| args.diff).and_then(|content| self.case.diff(&self.path, &self.file, content));
        Said { done: Some(done), diff, ..said }
    }

    pub fn make(&self, content: Option<&[u8]>) -> Result<(), Failure> {
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
