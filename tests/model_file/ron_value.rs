//! RON as far as the page on model files tells of it: values without types.

#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Record(Vec<(String, Value)>),
    Tuple(Vec<Value>),
    List(Vec<Value>),
    Text(String),
    Int(i64),
    Float(f64),
    Some(Box<Value>),
    /// `None`, `true`, `Linear`.
    Word(String),
}

impl Value {
    /// The field of that name.
    #[track_caller]
    pub fn at(&self, name: &str) -> &Value {
        let Value::Record(fields) = self else { panic!("no record: {self:?}") };
        &fields.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no `{name}`")).1
    }

    #[track_caller]
    pub fn items(&self) -> &[Value] {
        match self {
            Value::List(items) | Value::Tuple(items) => items,
            other => panic!("no list: {other:?}"),
        }
    }

    #[track_caller]
    pub fn text(&self) -> &str {
        let Value::Text(text) = self else { panic!("no text: {self:?}") };
        text
    }

    #[track_caller]
    pub fn int(&self) -> i64 {
        let Value::Int(value) = self else { panic!("no whole number: {self:?}") };
        *value
    }

    #[track_caller]
    pub fn float(&self) -> f64 {
        let Value::Float(value) = self else { panic!("no number: {self:?}") };
        *value
    }

    pub fn floats(&self) -> Vec<f64> {
        self.items().iter().map(Value::float).collect()
    }

    pub fn ints(&self) -> Vec<i64> {
        self.items().iter().map(Value::int).collect()
    }
}

pub fn parse(text: &str) -> Result<Value, String> {
    let mut reader = Reader { rest: text };
    let value = reader.value()?;
    reader.skip();
    if reader.rest.is_empty() { Ok(value) } else { Err(reader.unexpected()) }
}

struct Reader<'a> {
    rest: &'a str,
}

impl<'a> Reader<'a> {
    fn unexpected(&self) -> String {
        format!("unexpected: {}", self.rest.chars().take(40).collect::<String>())
    }

    /// Blanks and comments.
    fn skip(&mut self) {
        loop {
            self.rest = self.rest.trim_start();
            if !self.rest.starts_with("//") {
                return;
            }
            self.rest = self.rest.split_once('\n').map_or("", |(_, rest)| rest);
        }
    }

    fn takes(&mut self, mark: char) -> bool {
        self.skip();
        let rest = self.rest.strip_prefix(mark);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    fn value(&mut self) -> Result<Value, String> {
        self.skip();
        match self.rest.chars().next().ok_or("the end")? {
            '(' => self.round(),
            '[' => self.list('[', ']').map(Value::List),
            '"' => self.text().map(Value::Text),
            '-' | '0'..='9' => self.number(),
            c if c.is_ascii_alphabetic() => self.word_value(),
            _ => Err(self.unexpected()),
        }
    }

    fn word(&mut self) -> &'a str {
        let end = self.rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word
    }

    fn word_value(&mut self) -> Result<Value, String> {
        let word = self.word();
        match word {
            "inf" => Ok(Value::Float(f64::INFINITY)),
            "Some" => {
                let mut inner = self.list('(', ')')?;
                inner.pop().filter(|_| inner.is_empty()).map(|v| Value::Some(Box::new(v))).ok_or(self.unexpected())
            }
            word => Ok(Value::Word(word.into())),
        }
    }

    fn list(&mut self, open: char, close: char) -> Result<Vec<Value>, String> {
        let mut items = Vec::new();
        if !self.takes(open) {
            return Err(self.unexpected());
        }
        while !self.takes(close) {
            items.push(self.value()?);
            if !self.takes(',') && !self.rest.starts_with(close) {
                return Err(self.unexpected());
            }
        }
        Ok(items)
    }

    /// A record, or a fixed number of values.
    fn round(&mut self) -> Result<Value, String> {
        let before = self.rest;
        self.takes('(');
        self.skip();
        let name = self.word();
        let is_record = !name.is_empty() && self.takes(':');
        self.rest = before;
        if !is_record {
            return self.list('(', ')').map(Value::Tuple);
        }
        let mut fields = Vec::new();
        self.takes('(');
        while !self.takes(')') {
            self.skip();
            let name = self.word().to_string();
            if name.is_empty() || !self.takes(':') {
                return Err(self.unexpected());
            }
            fields.push((name, self.value()?));
            if !self.takes(',') && !self.rest.starts_with(')') {
                return Err(self.unexpected());
            }
        }
        Ok(Value::Record(fields))
    }

    fn number(&mut self) -> Result<Value, String> {
        let end = self.rest.find([',', ')', ']', ' ', '\n']).unwrap_or(self.rest.len());
        let (text, rest) = self.rest.split_at(end);
        self.rest = rest;
        if text.contains(['.', 'e', 'i']) {
            text.parse().map(Value::Float).map_err(|e| format!("{text}: {e}"))
        } else {
            text.parse().map(Value::Int).map_err(|e| format!("{text}: {e}"))
        }
    }

    fn text(&mut self) -> Result<String, String> {
        let mut out = String::new();
        let mut letters = self.rest[1..].chars();
        loop {
            match letters.next().ok_or("a text without an end")? {
                '"' => break,
                '\\' => out.push(match letters.next() {
                    Some('n') => '\n',
                    Some('r') => '\r',
                    Some('t') => '\t',
                    Some(c @ ('"' | '\'' | '\\')) => c,
                    Some('u') => {
                        let digits: String = letters.by_ref().skip(1).take_while(|c| *c != '}').collect();
                        let code = u32::from_str_radix(&digits, 16).map_err(|e| e.to_string())?;
                        char::from_u32(code).ok_or("no such character")?
                    }
                    other => return Err(format!("\\{other:?}")),
                }),
                c => out.push(c),
            }
        }
        self.rest = letters.as_str();
        Ok(out)
    }
}
