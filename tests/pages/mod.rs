//! Pages of specs and the reports on them: Markdown with a fenced `gng` block and a fenced `text` block by turns.
//!
//! `GONOGO_BLESS=1` rewrites the reports; read the difference before committing it.

use gonogo::cli::report::human;
use gonogo::diag::{Diagnostic, Fix, Sources, apply};
use std::fs;
use std::path::PathBuf;

/// The pages of a folder, and what is done with their specs.
pub struct Book {
    pub folder: &'static str,
    /// The whole spec around the lines that are shown.
    pub whole: fn(&str) -> String,
    pub run: fn(&str) -> (Sources, Vec<Diagnostic>),
}

pub struct Case {
    pub spec: String,
    pub report: String,
}

impl Book {
    /// Fails where a report is not as written down, or rewrites it.
    pub fn hold(&self) {
        let bless = std::env::var_os("GONOGO_BLESS").is_some();
        let mut wrong = Vec::new();
        for path in self.pages() {
            let text = fs::read_to_string(&path).unwrap();
            let mut blessed = text.clone();
            for Case { spec, report: expected } in cases(&text) {
                let found = self.report(&spec);
                if found != expected {
                    blessed = blessed.replacen(&page_of(&spec, &expected), &page_of(&spec, &found), 1);
                    wrong.push(format!("{}:\n{spec}\n--- expected\n{expected}\n--- found\n{found}", path.display()));
                }
            }
            if bless && blessed != text {
                fs::write(&path, blessed).unwrap();
            }
        }
        assert!(wrong.is_empty() || bless, "{}", wrong.join("\n"));
    }

    /// All reports in one text.
    pub fn reports(&self) -> String {
        self.cases().into_iter().map(|case| case.report).collect()
    }

    /// Makes every fix of every diagnostic, one at a time: the diagnostic is gone then, and no error has come. The codes
    /// that had a fix.
    pub fn mend(&self) -> Vec<&'static str> {
        let (mut wrong, mut codes) = (Vec::new(), Vec::new());
        for case in self.cases() {
            let text = (self.whole)(&case.spec);
            let (_, before) = (self.run)(&text);
            for diagnostic in &before {
                for fix in diagnostic.fixes.iter().filter(|fix| fix.edits.iter().all(|e| e.span.file == 0)) {
                    codes.push(diagnostic.code);
                    wrong.extend(self.mended(&text, &before, diagnostic, fix).err());
                }
            }
        }
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
        codes
    }

    fn mended(&self, text: &str, before: &[Diagnostic], diagnostic: &Diagnostic, fix: &Fix) -> Result<(), String> {
        let (mended, made) = apply(text, 0, [fix]);
        let (sources, after) = (self.run)(&mended);
        let count = |list: &[Diagnostic], like: &Diagnostic| {
            list.iter().filter(|d| (d.code, &d.message) == (like.code, &like.message)).count()
        };
        let gone = count(&after, diagnostic) < count(before, diagnostic);
        // What could not be read may have hidden faults of meaning.
        let of_text = |d: &&Diagnostic| d.code.starts_with("E01") || d.code == "E0309";
        let unread = |d: &Diagnostic| ["no such file", "not in the library"].contains(&d.labels[0].text.as_str());
        let hidden = before.iter().any(|d| of_text(&d) || unread(d));
        // The rest of a line is looked at only when its first mistake is mended.
        let line = |text: &str, at: u32| text[..at as usize].matches('\n').count();
        let changed: Vec<usize> = fix.edits.iter().map(|e| line(text, e.span.start)).collect();
        let rest = |d: &Diagnostic| changed.contains(&line(&mended, d.labels[0].span.start));
        let more = |d: &Diagnostic| count(&after, d) > count(before, d);
        let new = |d: &&Diagnostic| d.is_error() && more(d) && (!hidden || of_text(d)) && !rest(d);
        match after.iter().find(new) {
            None if gone && !made.is_empty() => Ok(()),
            _ => Err(format!(
                "{} `{}` of `{}` does not mend it:\n{mended}\n{}",
                diagnostic.code,
                fix.title,
                diagnostic.message,
                human(&sources, &after, false)
            )),
        }
    }

    fn report(&self, spec: &str) -> String {
        let (sources, diagnostics) = (self.run)(&(self.whole)(spec));
        let text = human(&sources, &diagnostics, false);
        text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
    }

    fn cases(&self) -> Vec<Case> {
        self.pages().iter().flat_map(|page| cases(&fs::read_to_string(page).unwrap())).collect()
    }

    fn pages(&self) -> Vec<PathBuf> {
        let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(self.folder);
        let mut pages: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        pages.sort();
        pages
    }
}

fn cases(text: &str) -> Vec<Case> {
    let blocks = |fence: &str| -> Vec<String> {
        let parts = text.split(fence).skip(1);
        parts.map(|part| part.split("```").next().unwrap_or("").to_string()).collect()
    };
    let (specs, reports) = (blocks("```gng\n"), blocks("```text\n"));
    assert_eq!(specs.len(), reports.len(), "a spec without a report, or the other way round");
    specs.into_iter().zip(reports).map(|(spec, report)| Case { spec, report }).collect()
}

fn page_of(spec: &str, report: &str) -> String {
    format!("```gng\n{spec}```\n\n```text\n{report}```")
}
