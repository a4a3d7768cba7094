//! The parts library: standard parts as families in this language, built into the compiler.
//!
//! In: the name behind `use`, `std/iso4762`. Out: the text that stands for it. What is said there is in the files
//! themselves, `specs/std/*.gng`; nothing here knows a standard.

use crate::diag::suggest::nearest;

/// What the names of the library begin with.
const PREFIX: &str = "std/";

macro_rules! files {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("../../specs/", $name, ".gng")))),*]
    };
}

/// Every file of the library by its name, in the order of a catalogue.
const FILES: &[(&str, &str)] = files![
    "std/iso2338",
    "std/iso8734",
    "std/iso4762",
    "std/iso10642",
    "std/iso4014",
    "std/iso4017",
    "std/iso4032",
    "std/iso7089",
    "std/din625",
    "std/din6885",
    "std/din471",
    "std/din472",
    "std/iso3601",
    "std/materials",
];

/// Names and texts of all files of the library.
pub fn files() -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES.iter().copied()
}

/// Whether a name behind `use` means the library: files of one's own end in `.gng`.
pub fn is_meant(name: &str) -> bool {
    name.starts_with(PREFIX) && !name.ends_with(".gng")
}

/// The text of a file of the library.
pub fn text(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(file, _)| *file == name).map(|(_, text)| *text)
}

/// The name of the library that is nearest to one it does not have.
pub fn nearest_file(name: &str) -> Option<&'static str> {
    nearest(name, FILES.iter().map(|(file, _)| *file))
}

/// The file that draws a family.
pub fn home_of(family: &str) -> Option<&'static str> {
    families().find(|(name, _)| *name == family).map(|(_, file)| file)
}

/// The family of the library that is nearest to a name, with its file.
pub fn nearest_family(name: &str) -> Option<(&'static str, &'static str)> {
    let near = nearest(name, families().map(|(name, _)| name))?;
    home_of(near).map(|file| (near, file))
}

/// Names of families with their files. Their lines begin as the formatter lays them out, which a test holds.
pub fn families() -> impl Iterator<Item = (&'static str, &'static str)> {
    let family = |line: &'static str| line.strip_prefix("part ")?.split_once('(').map(|(name, _)| name);
    FILES.iter().flat_map(move |(file, text)| text.lines().filter_map(family).map(|name| (name, *file)))
}
