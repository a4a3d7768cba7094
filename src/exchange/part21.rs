//! ISO 10303-21 clear text: entities with numbers, names and references.
//!
//! In: entities, one after the other. Out: the text of an exchange file. Knows the form of the text and nothing of what the
//! entities mean. The time stamp is always the same: the compiler has no clock, and the same spec gives the same bytes.

use std::fmt::Write;

/// A reference to an entity of the file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Id(u32);

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "#{}", self.0)
    }
}

/// Stands for the time of writing.
const NO_TIME: &str = "1970-01-01T00:00:00";

/// The data section while it grows.
#[derive(Debug, Default)]
pub(super) struct Data {
    text: String,
    count: u32,
}

impl Data {
    /// Adds an entity, given from its keyword to its closing parenthesis.
    pub fn add(&mut self, entity: std::fmt::Arguments) -> Id {
        self.count += 1;
        let id = Id(self.count);
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{id}={entity};");
        id
    }

    /// The whole file, of this schema.
    pub fn file(self, name: &str, schema: &str) -> String {
        let header = format!(
            "FILE_DESCRIPTION((''),'2;1');\nFILE_NAME({},'{NO_TIME}',(''),(''),{},{},'');\nFILE_SCHEMA(({}));\n",
            string(name),
            string(concat!("gonogo ", env!("CARGO_PKG_VERSION"))),
            string("gonogo"),
            string(schema),
        );
        let data = self.text;
        format!("ISO-10303-21;\nHEADER;\n{header}ENDSEC;\nDATA;\n{data}ENDSEC;\nEND-ISO-10303-21;\n")
    }
}

/// Adds an entity to a [`Data`], written as in the file.
macro_rules! entity {
    ($data:expr, $($form:tt)*) => { $data.add(format_args!($($form)*)) };
}
pub(super) use entity;

/// A number with every digit that tells it from its neighbours, and the point that the standard asks for.
pub(super) fn real(value: f64) -> String {
    // Adding zero makes a plain zero of a negative one.
    let text = format!("{:?}", value + 0.0);
    match text.split_once('e') {
        Some((mantissa, exponent)) if mantissa.contains('.') => format!("{mantissa}E{exponent}"),
        Some((mantissa, exponent)) => format!("{mantissa}.E{exponent}"),
        None => text.strip_suffix('0').filter(|t| t.ends_with('.')).map_or(text.clone(), String::from),
    }
}

/// Numbers in parentheses.
pub(super) fn reals(values: impl IntoIterator<Item = f64>) -> String {
    let parts: Vec<String> = values.into_iter().map(real).collect();
    format!("({})", parts.join(","))
}

/// References in parentheses.
pub(super) fn list(ids: &[Id]) -> String {
    let parts: Vec<String> = ids.iter().map(Id::to_string).collect();
    format!("({})", parts.join(","))
}

/// A string: quotes and backslashes doubled, other than printable ASCII as UTF-16 in hexadecimal (`\X2\`) or, beyond
/// its first plane, UTF-32 (`\X4\`).
pub(super) fn string(text: &str) -> String {
    let mut out = String::from("'");
    for c in text.chars() {
        let _ = match c {
            '\'' => out.write_str("''"),
            '\\' => out.write_str("\\\\"),
            ' '..='~' => out.write_char(c),
            c if u32::from(c) <= 0xffff => write!(out, "\\X2\\{:04X}\\X0\\", u32::from(c)),
            c => write!(out, "\\X4\\{:08X}\\X0\\", u32::from(c)),
        };
    }
    out.push('\'');
    out
}

/// `.T.` or `.F.`
pub(super) fn logical(value: bool) -> &'static str {
    if value { ".T." } else { ".F." }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_and_come_back_the_same() {
        for (value, text) in
            [(0.0, "0."), (-0.0, "0."), (1.0, "1."), (-2.5, "-2.5"), (1e-7, "1.E-7"), (1.5e300, "1.5E300")]
        {
            assert_eq!(real(value), text);
        }
        for value in [std::f64::consts::PI, 0.1 + 0.2, -1.0 / 3.0, 6.02e23, 123456.789e-12] {
            assert_eq!(real(value).parse::<f64>().unwrap(), value);
        }
    }

    #[test]
    fn strings_are_escaped() {
        assert_eq!(string("bore[2].side"), "'bore[2].side'");
        assert_eq!(string("it's a \\"), "'it''s a \\\\'");
        assert_eq!(string("ø6 ⌀"), "'\\X2\\00F8\\X0\\6 \\X2\\2300\\X0\\'");
        assert_eq!(string("a\n"), "'a\\X2\\000A\\X0\\'");
    }

    #[test]
    fn entities_are_counted_from_one() {
        let mut data = Data::default();
        let point = entity!(data, "CARTESIAN_POINT('',{})", reals([0.0, 1.0, 2.0]));
        entity!(data, "VERTEX_POINT('',{point})");
        let file = data.file("part", "SCHEMA");
        assert!(
            file.contains("DATA;\n#1=CARTESIAN_POINT('',(0.,1.,2.));\n#2=VERTEX_POINT('',#1);\nENDSEC;\n"),
            "{file}"
        );
    }
}
