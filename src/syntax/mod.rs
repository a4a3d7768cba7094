//! Stage 1: text becomes a syntax tree.
//!
//! In: the text of one file. Out: [`ast::File`] with spans and comments, and what is wrong with the text. Parsing never
//! fails and never panics: what could not be read is left out of the tree and reported. Nothing here knows what a name
//! means; that is `design`. The grammar is `grammar/gonogo.pest`, and only `parse` knows the parser generator.

pub mod ast;
mod faults;
mod format;
mod heads;
mod letters;
mod lines;
mod parse;
mod scan;
mod table;

pub use format::format;
pub use parse::parse;
