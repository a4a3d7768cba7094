//! Stage 4: solids and poses become contacts, liaisons, error trees, an insertion order and error modes.

pub mod place;
