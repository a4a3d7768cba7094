//! A spec with the files it uses, read and resolved, and what can be looked up in it.

use super::index::{Index, Mention, Mentioned};
use super::sites::{Dims, dims_of, each_line};
use super::text::Text;
use super::uri::address;
use crate::design::{Read, Reading, Survey, survey};
use crate::diag::Span;
use crate::syntax::ast::Dim;
use lsp_types::{Location, Uri};
use std::cell::OnceCell;

/// One spec as it stands now.
#[derive(Debug)]
pub struct Project {
    pub survey: Survey,
    texts: Vec<Text>,
    index: OnceCell<Index>,
}

impl Project {
    pub fn new(root: &str, read: Read) -> Project {
        let survey = survey(root, read);
        let texts = survey.loaded.sources.files.iter().map(|(_, text)| Text::new(text.clone())).collect();
        Project { survey, texts, index: OnceCell::new() }
    }

    pub fn index(&self) -> &Index {
        self.index.get_or_init(|| Index::new(&self.survey.trees))
    }

    /// The number of a file by its name.
    pub fn file(&self, name: &str) -> Option<u32> {
        self.survey.loaded.sources.files.iter().position(|(n, _)| n == name).map(|i| i as u32)
    }

    pub fn name(&self, file: u32) -> &str {
        self.survey.loaded.sources.files.get(file as usize).map_or("", |(name, _)| name)
    }

    pub fn text(&self, file: u32) -> Option<&Text> {
        self.texts.get(file as usize)
    }

    pub fn slice(&self, span: Span) -> &str {
        self.text(span.file).map_or("", |text| text.slice(span))
    }

    pub fn uri(&self, file: u32) -> Option<Uri> {
        address(self.name(file))
    }

    pub fn location(&self, span: Span) -> Option<Location> {
        Some(Location::new(self.uri(span.file)?, self.text(span.file)?.range_of(span)))
    }

    /// What the compiler took the number at a place for.
    pub fn reading(&self, span: Span) -> Option<&Reading> {
        let place = |s: Span| (s.file, s.start, s.end);
        let found = self.survey.readings.binary_search_by_key(&place(span), |r| place(r.span)).ok()?;
        self.survey.readings.get(found)
    }

    /// The smallest dimension round a place, as written.
    pub fn dim_at(&self, file: u32, offset: usize) -> Option<&Dim> {
        let mut found: Option<&Dim> = None;
        self.each_dim(file, &mut |site| {
            let span = site.dim.span;
            if (span.start as usize..=span.end as usize).contains(&offset) {
                found = Some(site.dim);
            }
        });
        found
    }

    /// Shows every dimension of a file, in the order of the text.
    pub fn each_dim<'a>(&'a self, file: u32, visit: &mut dyn FnMut(Dims<'a>)) {
        let Some(tree) = self.survey.trees.get(file as usize) else { return };
        each_line(&tree.lines, "file", &mut |line, block| {
            let mut dims = Vec::new();
            dims_of(&line.stmt, block, &mut dims);
            dims.into_iter().for_each(&mut *visit);
        });
    }

    /// What a word at a place names, most telling first: of `place shaft on gear` the part before the component.
    pub fn named_at(&self, file: u32, offset: usize) -> Vec<Mention> {
        let mut found: Vec<Mention> = self.index().at(file, offset).copied().collect();
        found.sort_by_key(|m| m.role != Mentioned::Shorthand);
        found
    }
}
