//! Files by the names that editors give them.
//!
//! In: `file:` addresses. Out: names as the compiler takes them, with slashes, and back. Any other address (a text that was
//! never saved) is a name as it stands.

use lsp_types::Uri;
use std::str::FromStr;

const FILE: &str = "file://";
/// Where clients that know how to ask for them keep the files of the parts library: `gonogo:/std/iso2338.gng`.
const LIBRARY: &str = "gonogo:/std/";

/// The name of the file at an address.
pub fn name(uri: &Uri) -> String {
    let text = uri.as_str();
    if let Some(name) = text.strip_prefix(LIBRARY) {
        return format!("std/{}", name.strip_suffix(".gng").unwrap_or(name));
    }
    let Some(rest) = text.strip_prefix(FILE) else { return text.to_string() };
    // Behind the host, which is empty but for network shares.
    let path = rest.find('/').map_or(rest, |at| if at == 0 { rest } else { &text[FILE.len() - 2..] });
    let path = decoded(path);
    match path.as_bytes() {
        // `/c:/specs`: a drive of Windows.
        [b'/', drive, b':', ..] if drive.is_ascii_alphabetic() => path[1..].to_string(),
        _ => path,
    }
}

/// The address of a file by its name; `None` for a name that has none, such as a file of the parts library.
pub fn address(name: &str) -> Option<Uri> {
    let is_drive = matches!(name.as_bytes(), [drive, b':', b'/', ..] if drive.is_ascii_alphabetic());
    let text = match name {
        _ if is_drive => format!("{FILE}/{}", encoded(name)),
        _ if name.starts_with("//") => format!("file:{}", encoded(name)),
        _ if name.starts_with('/') => format!("{FILE}{}", encoded(name)),
        _ if name.contains(':') => name.to_string(),
        _ => return None,
    };
    Uri::from_str(&text).ok()
}

/// The address of a file of the parts library, which only some clients can open.
pub fn library_address(name: &str) -> Option<Uri> {
    Uri::from_str(&format!("{LIBRARY}{}.gng", name.strip_prefix("std/")?)).ok()
}

fn decoded(text: &str) -> String {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let hex = tail.get(..2).and_then(|pair| std::str::from_utf8(pair).ok());
        let byte = hex.filter(|_| first == b'%').and_then(|pair| u8::from_str_radix(pair, 16).ok());
        bytes.push(byte.unwrap_or(first));
        rest = if byte.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

fn encoded(name: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"/-._~".contains(&b);
    name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_addresses_are_each_others() {
        for (uri, file) in [
            ("file:///home/a/my%20specs/%C3%B8.gng", "/home/a/my specs/ø.gng"),
            ("file:///c%3A/specs/a.gng", "c:/specs/a.gng"),
            ("file://server/share/a.gng", "//server/share/a.gng"),
            ("untitled:Untitled-1", "untitled:Untitled-1"),
        ] {
            let parsed = Uri::from_str(uri).unwrap();
            assert_eq!(name(&parsed), file);
            assert_eq!(address(file).unwrap().as_str(), uri);
        }
        assert_eq!(decoded("a%2Gb%4%41%"), "a%2Gb%4A%");
        assert_eq!(address("std/iso2338"), None);
        assert_eq!(name(&library_address("std/iso2338").unwrap()), "std/iso2338");
    }
}
