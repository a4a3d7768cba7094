//! A reader of exchange files, written from the standard and not from the writer.

use std::collections::BTreeMap;

/// The data section: keyword and parameters by number.
pub struct File {
    entities: BTreeMap<u32, (String, String)>,
}

impl File {
    /// Panics, with the entity, on what no reader would accept: a number twice, a reference to nothing, a form that is no entity.
    pub fn parse(text: &str) -> File {
        assert!(text.starts_with("ISO-10303-21;\nHEADER;\n") && text.ends_with("ENDSEC;\nEND-ISO-10303-21;\n"));
        assert!(text.is_ascii(), "the clear text is ASCII");
        let data = &text[text.find("DATA;\n").expect("a data section") + 6..text.rfind("ENDSEC;").unwrap()];
        let mut entities = BTreeMap::new();
        for line in data.lines() {
            let (number, form) = line.strip_prefix('#').and_then(|l| l.split_once('=')).expect(line);
            let form = form.strip_suffix(';').expect(line);
            let (word, parameters) = form.split_at(form.find('(').expect(line));
            assert!(word.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_'), "{line}");
            balanced(parameters);
            let old = entities.insert(number.parse().expect(line), (word.to_string(), parameters.to_string()));
            assert!(old.is_none(), "twice: {line}");
        }
        let file = File { entities };
        for id in file.entities.keys() {
            file.references(*id).iter().for_each(|r| assert!(file.entities.contains_key(r), "#{id} refers to #{r}"));
        }
        file
    }

    /// The entities with this keyword.
    pub fn all(&self, word: &str) -> impl Iterator<Item = u32> {
        self.entities.iter().filter(move |(_, e)| e.0 == word).map(|(id, _)| *id)
    }

    /// The keyword of an entity; empty for one of several types.
    pub fn word(&self, id: u32) -> &str {
        &self.entities[&id].0
    }

    /// What an entity refers to, in order.
    pub fn references(&self, id: u32) -> Vec<u32> {
        let text = unquoted(&self.entities[&id].1);
        let digits = |rest: &str| rest.chars().take_while(char::is_ascii_digit).collect::<String>();
        text.split('#').skip(1).map(|rest| digits(rest).parse().expect("a number follows #")).collect()
    }

    /// The last logical of an entity.
    pub fn flag(&self, id: u32) -> Option<bool> {
        let text = unquoted(&self.entities[&id].1);
        if text.ends_with(".T.)") {
            Some(true)
        } else if text.ends_with(".F.)") {
            Some(false)
        } else {
            None
        }
    }
}

/// Without its strings.
fn unquoted(text: &str) -> String {
    text.split('\'').step_by(2).collect()
}

fn balanced(parameters: &str) {
    assert_eq!(parameters.matches('\'').count() % 2, 0, "{parameters}");
    let text = unquoted(parameters);
    let mut depth = 0;
    for (i, c) in text.char_indices() {
        depth += i32::from(c == '(') - i32::from(c == ')');
        assert!(depth > 0 || i + 1 == text.len(), "{parameters}");
    }
    assert_eq!(depth, 0, "{parameters}");
}
