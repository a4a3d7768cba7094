//! The runtime as a WebAssembly module, looked at before a page takes it in.
//!
//! In: the bytes of a file. Out: [`Module`], or a sentence why it is none. Reads names and the version; never runs anything
//! (WebAssembly Core Specification 2.0, chapter 5: a module is a row of sections, each with its number and its size).

/// What the page calls (`include/gonogo.mjs`).
const CALLED: &[&str] = &[
    "memory",
    "gonogo_abi",
    "gonogo_alloc",
    "gonogo_free",
    "gonogo_open",
    "gonogo_photo_size",
    "gonogo_show_file",
    "gonogo_text_free",
    "gonogo_version",
];
const CUSTOM: u8 = 0;
const IMPORTS: u8 = 2;
const EXPORTS: u8 = 7;

/// The bytes of a module that has what the page calls, is of this version, and asks for nothing.
#[derive(Clone, Copy)]
pub struct Module<'a>(&'a [u8]);

impl<'a> Module<'a> {
    pub fn read(bytes: &'a [u8]) -> Result<Module<'a>, String> {
        let sections = bytes.strip_prefix(b"\0asm\x01\0\0\0").ok_or("this is no WebAssembly module")?;
        let (mut exports, mut version) = (Vec::new(), None);
        let mut rest = Reader(sections);
        while let Some(number) = rest.byte() {
            let mut section = Reader(rest.sized().ok_or(CUT)?);
            match number {
                CUSTOM if section.sized() == Some(b"gonogo") => version = Some(section.0),
                IMPORTS if section.number() != Some(0) => {
                    return Err("this module asks its host for functions, which the runtime does not".into());
                }
                EXPORTS => exports = names(&mut section).ok_or(CUT)?,
                _ => {}
            }
        }
        let missing = CALLED.iter().find(|name| !exports.contains(&name.as_bytes()));
        let version = version.map(String::from_utf8_lossy);
        match (version, missing) {
            (Some(version), _) if version != env!("CARGO_PKG_VERSION") => {
                Err(format!("this module is of gonogo {version}, and this is {}", env!("CARGO_PKG_VERSION")))
            }
            (Some(_), None) => Ok(Module(bytes)),
            (_, Some(name)) => Err(format!("this module has no `{name}`: it is not the runtime's")),
            (None, None) => Err("this module does not say of which version of gonogo it is".into()),
        }
    }

    pub(super) fn bytes(&self) -> &'a [u8] {
        self.0
    }
}

const CUT: &str = "this WebAssembly module is cut short";

/// Names of what a module exports.
fn names<'a>(section: &mut Reader<'a>) -> Option<Vec<&'a [u8]>> {
    let count = section.number()?;
    let mut all = Vec::new();
    for _ in 0..count {
        all.push(section.sized()?);
        let (_kind, _index) = (section.byte()?, section.number()?);
    }
    Some(all)
}

struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    /// An unsigned number of up to 32 bits, seven a byte, the lowest first (LEB128).
    fn number(&mut self) -> Option<u32> {
        let mut value = 0u64;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return u32::try_from(value).ok();
            }
        }
        None
    }

    /// Bytes behind their number.
    fn sized(&mut self) -> Option<&'a [u8]> {
        let size = self.number()? as usize;
        let (taken, rest) = self.0.split_at_checked(size)?;
        self.0 = rest;
        Some(taken)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn sized(bytes: &[u8]) -> Vec<u8> {
        let (low, high) = (bytes.len() as u8 & 0x7f | 0x80, (bytes.len() >> 7) as u8);
        [&[low, high], bytes].concat()
    }

    fn section(number: u8, content: &[u8]) -> Vec<u8> {
        [&[number], &sized(content)[..]].concat()
    }

    /// A module with these exports that says it is of a version.
    fn module(exports: &[&str], version: &str) -> Vec<u8> {
        let all = exports.iter().flat_map(|name| [sized(name.as_bytes()), vec![0, 3]].concat());
        let exports: Vec<u8> = [exports.len() as u8].into_iter().chain(all).collect();
        let custom = [&sized(b"gonogo"), version.as_bytes()].concat();
        [&b"\0asm\x01\0\0\0"[..], &section(IMPORTS, &[0]), &section(EXPORTS, &exports), &section(CUSTOM, &custom)]
            .concat()
    }

    pub fn whole() -> Vec<u8> {
        module(CALLED, env!("CARGO_PKG_VERSION"))
    }

    #[test]
    fn a_module_of_this_version_with_all_functions_is_taken() {
        assert!(Module::read(&whole()).is_ok());
    }

    #[test]
    fn anything_else_is_refused_with_the_reason() {
        let said = |bytes: &[u8]| Module::read(bytes).err().unwrap_or_default();
        assert!(said(b"not a module").contains("no WebAssembly"));
        assert!(said(&[]).contains("no WebAssembly"));
        assert!(said(&module(CALLED, "0.0.1")).contains("of gonogo 0.0.1"));
        assert!(said(&module(&CALLED[1..], env!("CARGO_PKG_VERSION"))).contains("`memory`"));
        assert!(said(b"\0asm\x01\0\0\0").contains("`memory`"), "an empty module");
        let wanting = [&whole()[..], &section(IMPORTS, &[1, 1, b'a', 1, b'b', 0, 0])].concat();
        assert!(said(&wanting).contains("asks its host"));
        // Wherever it is cut it is refused, and nothing panics.
        let whole = whole();
        assert!((0..whole.len()).all(|end| Module::read(&whole[..end]).is_err()));
        assert!(said(&[&whole[..], &[7, 0xff, 0xff, 0xff, 0xff, 0xff, 1]].concat()).contains("cut short"));
    }
}
