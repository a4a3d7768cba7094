//! The pages behind `gonogo explain CODE`: what a code means, and how the fault looks and is mended.

/// Pages by code, in the order of the codes.
const PAGES: &[(&str, &str)] = &[
    ("E0101", include_str!("explain/E0101.md")),
    ("E0102", include_str!("explain/E0102.md")),
    ("E0103", include_str!("explain/E0103.md")),
    ("E0104", include_str!("explain/E0104.md")),
    ("E0105", include_str!("explain/E0105.md")),
    ("E0201", include_str!("explain/E0201.md")),
    ("E0202", include_str!("explain/E0202.md")),
    ("E0203", include_str!("explain/E0203.md")),
    ("E0204", include_str!("explain/E0204.md")),
    ("E0205", include_str!("explain/E0205.md")),
    ("E0206", include_str!("explain/E0206.md")),
    ("E0207", include_str!("explain/E0207.md")),
    ("E0208", include_str!("explain/E0208.md")),
    ("W0209", include_str!("explain/W0209.md")),
    ("E0210", include_str!("explain/E0210.md")),
    ("E0211", include_str!("explain/E0211.md")),
    ("E0212", include_str!("explain/E0212.md")),
    ("E0213", include_str!("explain/E0213.md")),
    ("E0214", include_str!("explain/E0214.md")),
    ("E0301", include_str!("explain/E0301.md")),
    ("E0302", include_str!("explain/E0302.md")),
    ("E0303", include_str!("explain/E0303.md")),
    ("W0304", include_str!("explain/W0304.md")),
    ("E0305", include_str!("explain/E0305.md")),
    ("E0306", include_str!("explain/E0306.md")),
    ("E0307", include_str!("explain/E0307.md")),
    ("E0309", include_str!("explain/E0309.md")),
    ("W0310", include_str!("explain/W0310.md")),
    ("W0311", include_str!("explain/W0311.md")),
    ("W0312", include_str!("explain/W0312.md")),
    ("E0401", include_str!("explain/E0401.md")),
    ("W0402", include_str!("explain/W0402.md")),
    ("E0403", include_str!("explain/E0403.md")),
    ("E0405", include_str!("explain/E0405.md")),
    ("E0406", include_str!("explain/E0406.md")),
    ("E0407", include_str!("explain/E0407.md")),
    ("E0408", include_str!("explain/E0408.md")),
    ("E0410", include_str!("explain/E0410.md")),
    ("W0411", include_str!("explain/W0411.md")),
    ("E0501", include_str!("explain/E0501.md")),
    ("W0502", include_str!("explain/W0502.md")),
    ("E0503", include_str!("explain/E0503.md")),
    ("E0504", include_str!("explain/E0504.md")),
    ("E0505", include_str!("explain/E0505.md")),
    ("E0506", include_str!("explain/E0506.md")),
    ("W0507", include_str!("explain/W0507.md")),
    ("E0508", include_str!("explain/E0508.md")),
    ("E0509", include_str!("explain/E0509.md")),
    ("W0510", include_str!("explain/W0510.md")),
    ("E0601", include_str!("explain/E0601.md")),
    ("W0602", include_str!("explain/W0602.md")),
    ("E0603", include_str!("explain/E0603.md")),
    ("W0604", include_str!("explain/W0604.md")),
    ("E0605", include_str!("explain/E0605.md")),
    ("E0701", include_str!("explain/E0701.md")),
    ("W0703", include_str!("explain/W0703.md")),
    ("E0801", include_str!("explain/E0801.md")),
    ("E0802", include_str!("explain/E0802.md")),
    ("E0803", include_str!("explain/E0803.md")),
    ("E0804", include_str!("explain/E0804.md")),
    ("E0805", include_str!("explain/E0805.md")),
    ("E0806", include_str!("explain/E0806.md")),
    ("E0807", include_str!("explain/E0807.md")),
    ("E0808", include_str!("explain/E0808.md")),
    ("E0901", include_str!("explain/E0901.md")),
    ("E0902", include_str!("explain/E0902.md")),
    ("E0903", include_str!("explain/E0903.md")),
];

/// The page of a code such as `E0305`; `None` for a code that does not exist.
pub fn explain(code: &str) -> Option<&'static str> {
    PAGES.iter().find(|(known, _)| known.eq_ignore_ascii_case(code)).map(|(_, page)| *page)
}

/// Every code that has a page.
pub fn codes() -> impl Iterator<Item = &'static str> {
    PAGES.iter().map(|(code, _)| *code)
}

/// What a code means, in the words its page begins with.
pub fn title(code: &str) -> Option<&'static str> {
    explain(code)?.lines().next()?.split_once(": ").map(|(_, title)| title)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_begins_with_its_code() {
        for code in codes() {
            assert!(explain(code).is_some_and(|page| page.starts_with(&format!("# {code}: "))), "{code}");
        }
        assert_eq!(explain("e0305"), explain("E0305"));
        assert_eq!(explain("E9999"), None);
    }
}
