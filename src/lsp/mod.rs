//! What editors ask about specs: the language server without its wires.
//!
//! In: messages of the Language Server Protocol as JSON, and a way to read files. Out: answers as JSON. Nothing here knows a
//! pipe, a clock or a thread: `cli::lsp` has those, and runs the slow stages. Everything is worked out from the texts as
//! they stand: what is being typed rarely parses, so completion goes by words (`context`), and everything else by the tree
//! of what could be read and by what the compiler took its numbers for.

mod complete;
mod context;
mod desk;
mod fixes;
mod hints;
mod hover;
mod index;
mod keywords;
mod layout;
mod numbers;
mod outline;
mod project;
mod rename;
mod report;
mod requests;
mod server;
mod sites;
mod text;
mod uri;
pub mod words;

pub use desk::Disk;
pub use server::{Fault, Job, Notice, Server};
pub use uri::{address, name};
