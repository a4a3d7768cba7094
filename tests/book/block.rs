//! Fenced blocks of a chapter.

/// A fenced block: what stands behind the fence, and its lines.
#[derive(Debug)]
pub struct Block {
    /// Line of the fence, from 1.
    pub line: usize,
    marks: Vec<String>,
    pub text: String,
}

impl Block {
    pub fn language(&self) -> &str {
        self.marks.first().map_or("", String::as_str)
    }

    /// `slow`
    pub fn has(&self, mark: &str) -> bool {
        self.marks.iter().any(|m| m == mark)
    }

    /// `lid.gng` for `file` in `file=lid.gng`.
    pub fn value(&self, key: &str) -> Option<&str> {
        self.marks.iter().find_map(|m| m.strip_prefix(key)?.strip_prefix('='))
    }

    /// The mark without a value: what the lines belong to.
    pub fn kind(&self) -> Option<&str> {
        self.marks.iter().skip(1).find(|m| !m.contains('=')).map(String::as_str)
    }
}

/// The blocks of a text in their order.
pub fn blocks(text: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut inside = false;
    for (line, text) in (1..).zip(text.lines()) {
        match (text.strip_prefix("```"), inside) {
            (Some(info), false) => {
                let marks = info.split([',', ' ']).filter(|m| !m.is_empty()).map(str::to_string).collect();
                found.push(Block { line, marks, text: String::new() });
                inside = true;
            }
            (Some(_), true) => inside = false,
            (None, true) => {
                let block = found.last_mut().unwrap();
                block.text.push_str(text);
                block.text.push('\n');
            }
            (None, false) => {}
        }
    }
    assert!(!inside, "a block is not closed");
    found
}
