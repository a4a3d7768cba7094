//! From what the parser generator found to nodes of the syntax tree.

use super::Rule;
use crate::diag::Span;
use crate::syntax::ast::*;
use pest::iterators::Pair;

/// Makes tree nodes from the pairs of one item, with spans in the whole file.
pub struct Builder {
    pub file: u32,
    pub offset: usize,
}

type Node<'i> = Pair<'i, Rule>;

impl Builder {
    /// The first `len` bytes of the item.
    pub fn whole(&self, len: usize) -> Span {
        self.within(0, len)
    }

    /// A stretch of the item.
    pub fn within(&self, start: usize, end: usize) -> Span {
        Span { file: self.file, start: (self.offset + start) as u32, end: (self.offset + end) as u32 }
    }

    fn span(&self, pair: &Node) -> Span {
        // A rule that ends with something optional takes the blanks before it.
        let (start, len) = (pair.as_span().start(), pair.as_str().trim_end().len());
        self.within(start, start + len)
    }

    /// The statements inside a pair, and what stands behind the last.
    pub fn lines(&self, pair: Node) -> (Vec<Line>, Vec<Gap>) {
        let (mut lines, mut gaps): (Vec<Line>, Vec<Gap>) = (Vec::new(), Vec::new());
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::EOI => {}
                Rule::blank_line => gaps.push(Gap::Blank),
                Rule::comment_line => gaps.push(Gap::Comment(inner.as_str().trim().to_string())),
                Rule::note => {
                    if let Some(line) = lines.last_mut() {
                        line.after = Some(inner.as_str().trim_end().to_string());
                    }
                }
                _ => {
                    let span = self.span(&inner);
                    let before = std::mem::take(&mut gaps);
                    lines.push(Line { before, stmt: self.stmt(inner), after: None, span });
                }
            }
        }
        (lines, gaps)
    }

    fn body(&self, pair: Node) -> Body {
        let first = pair.clone().into_inner().next().filter(|p| p.as_rule() == Rule::note);
        let (lines, end) = self.lines(pair);
        Body { open: first.map(|p| p.as_str().trim_end().to_string()), lines, end }
    }

    fn stmt(&self, pair: Node) -> Stmt {
        let rule = pair.as_rule();
        let mut inner = Children::of(pair.clone());
        match rule {
            Rule::version => Stmt::Version(inner.text(Rule::integer).parse().unwrap_or(u64::MAX)),
            Rule::units => {
                let words: Vec<Name> = inner.all(Rule::word).iter().map(|p| self.name(p)).collect();
                Stmt::Units(words[0].clone(), words[1].clone())
            }
            Rule::general => Stmt::Tolerances(self.name(&inner.take(Rule::class))),
            Rule::use_file => Stmt::Use(self.string(&inner.take(Rule::string))),
            Rule::let_dim => {
                Stmt::Let { name: self.name(&inner.take(Rule::name)), dim: self.dim(inner.take(Rule::dim)) }
            }
            Rule::material => {
                Stmt::Material { name: self.name(&inner.take(Rule::name)), body: self.body(inner.last()) }
            }
            Rule::family | Rule::table | Rule::row | Rule::member => self.family(rule, &inner),
            Rule::part => Stmt::Part { name: self.name(&inner.take(Rule::name)), body: self.body(inner.last()) },
            Rule::assembly => {
                Stmt::Assembly { name: self.name(&inner.take(Rule::name)), body: self.body(inner.last()) }
            }
            Rule::station => Stmt::Station { name: self.name(&inner.take(Rule::name)), body: self.body(inner.last()) },
            Rule::inspect => {
                Stmt::Inspect { name: inner.find(Rule::name).map(|p| self.name(&p)), body: self.body(inner.last()) }
            }
            Rule::camera => Stmt::Camera {
                name: inner.find(Rule::camera_name).map(|p| self.name(&p)),
                mode: inner.find(Rule::mode).map(|p| self.name(&p)),
                body: self.body(inner.last()),
            },
            Rule::floor => Stmt::Floor(self.body(inner.last())),
            Rule::vary => Stmt::Vary(self.body(inner.last())),
            Rule::train => Stmt::Train(self.body(inner.last())),
            Rule::light => Stmt::Light { name: self.name(&inner.take(Rule::name)), call: self.call(inner.last()) },
            Rule::outline => Stmt::Outline { name: self.name(&inner.take(Rule::name)), body: self.body(inner.last()) },
            Rule::start => Stmt::Start { at: self.point(inner.take(Rule::point)), corner: self.corner(&inner) },
            Rule::line | Rule::arc => Stmt::Side(Box::new(self.side(inner))),
            Rule::feature => Stmt::Feature(Box::new(self.feature(inner))),
            Rule::root => {
                let names: Vec<Name> = inner.all(Rule::name).iter().map(|p| self.name(p)).collect();
                Stmt::Root { name: names[0].clone(), part: names.get(1).cloned() }
            }
            Rule::place => Stmt::Place(Box::new(self.place(inner))),
            Rule::measure => Stmt::Measure(Box::new(self.measure(inner))),
            Rule::watch => Stmt::Watch {
                path: self.path(inner.take(Rule::path)),
                args: inner.find(Rule::args).map(|p| self.args(p)),
            },
            Rule::ignore => Stmt::Ignore(self.path(inner.take(Rule::path))),
            _ => Stmt::Field { key: self.name(&inner.take(Rule::key)), value: self.value(inner.last()) },
        }
    }

    /// What a drawing with a table of sizes is written with.
    fn family(&self, rule: Rule, inner: &Children) -> Stmt {
        let params = || self.params(inner.take(Rule::params));
        match rule {
            Rule::row => Stmt::Row {
                key: self.name(&inner.take(Rule::row_key)),
                cells: Children::of(inner.last()).all(Rule::dim).into_iter().map(|p| self.dim(p)).collect(),
            },
            Rule::member => Stmt::Member { name: self.name(&inner.take(Rule::name)), call: self.call(inner.last()) },
            Rule::table => Stmt::Table {
                name: self.name(&inner.take(Rule::name)),
                columns: params(),
                body: self.body(inner.last()),
            },
            _ => Stmt::Family {
                name: self.name(&inner.take(Rule::name)),
                params: params(),
                body: self.body(inner.last()),
            },
        }
    }

    fn params(&self, pair: Node) -> Vec<Name> {
        Children::of(pair).all(Rule::name).iter().map(|p| self.name(p)).collect()
    }

    fn feature(&self, inner: Children) -> Feature {
        let point = |rule| inner.find(rule).map(|p| self.point(Children::of(p).take(Rule::point)));
        Feature {
            op: self.name(&inner.take(Rule::op)),
            name: self.name(&inner.take(Rule::name)),
            count: inner.find(Rule::count).map(|p| self.count(&p)),
            shape: self.shape(&inner),
            at: point(Rule::at),
            turn: point(Rule::turn),
            on: inner.find(Rule::on).map(|p| self.call(Children::of(p).take(Rule::call))),
        }
    }

    fn shape(&self, inner: &Children) -> Shape {
        match inner.find(Rule::kw_group) {
            Some(word) => Shape::Group { word: self.name(&word), body: self.body(inner.take(Rule::part_body)) },
            None => Shape::Call(self.call(inner.take(Rule::call))),
        }
    }

    fn side(&self, inner: Children) -> Side {
        let name = inner.find(Rule::side_name).map(|p| self.name(&Children::of(p).take(Rule::name)));
        let arc = inner.find(Rule::hand).map(|hand| Arc {
            radius: self.dim(inner.take(Rule::dim)),
            hand: self.name(&hand),
            long: inner.find(Rule::long).is_some(),
        });
        Side { name, to: self.point(inner.take(Rule::point)), arc, corner: self.corner(&inner) }
    }

    fn corner(&self, inner: &Children) -> Option<Corner> {
        let pair = inner.find(Rule::corner)?;
        let span = self.span(&pair);
        let kind = Children::of(pair).last();
        let size = self.dim(Children::of(kind.clone()).take(Rule::dim));
        let kind = if kind.as_rule() == Rule::round { CornerKind::Round } else { CornerKind::Chamfer };
        Some(Corner { kind, size, span })
    }

    fn place(&self, inner: Children) -> Place {
        let names: Vec<Name> = inner.all(Rule::name).iter().map(|p| self.name(p)).collect();
        Place {
            name: names[0].clone(),
            count: inner.find(Rule::count).map(|p| self.count(&p)),
            part: names.get(1).cloned(),
            on: self.path(inner.take(Rule::path)),
            body: inner.find(Rule::field_body).map(|p| self.body(p)),
        }
    }

    fn measure(&self, inner: Children) -> Measure {
        let [from, to] = [0, 1].map(|i| self.face(&inner.all(Rule::face)[i]));
        let within = inner.find(Rule::within).map(|p| self.dim(Children::of(p).take(Rule::dim)));
        Measure { name: self.name(&inner.take(Rule::name)), from, to, within }
    }

    fn face(&self, pair: &Node) -> Face {
        let inner = Children::of(pair.clone());
        let component = self.segment(inner.take(Rule::segment));
        Face { component, face: self.name(&inner.take(Rule::face_name)), span: self.span(pair) }
    }

    fn name(&self, pair: &Node) -> Name {
        Name { text: pair.as_str().to_string(), span: self.span(pair) }
    }

    /// A string without its quotes.
    fn string(&self, pair: &Node) -> Name {
        Name { text: pair.as_str().trim_matches('"').to_string(), span: self.span(pair) }
    }

    fn count(&self, pair: &Node) -> Count {
        Count { value: pair.as_str().trim_end_matches('x').parse().unwrap_or(u64::MAX), span: self.span(pair) }
    }

    fn call(&self, pair: Node) -> Call {
        let inner = Children::of(pair);
        Call { name: self.name(&inner.take(Rule::word)), args: self.args(inner.take(Rule::args)) }
    }

    fn args(&self, pair: Node) -> Args {
        let span = self.span(&pair);
        let (mut list, mut notes): (Vec<Arg>, Vec<String>) = (Vec::new(), Vec::new());
        let mut end = pair.as_span().start();
        for inner in pair.into_inner() {
            let place = inner.as_span();
            if inner.as_rule() == Rule::note {
                let note = inner.as_str().trim_end().to_string();
                let same_line = !place.get_input()[end..place.start()].contains(['\n', '\r']);
                match list.last_mut().filter(|arg| same_line && notes.is_empty() && arg.after.is_none()) {
                    Some(arg) => arg.after = Some(note),
                    None => notes.push(note),
                }
                continue;
            }
            end = place.end();
            let inner = Children::of(inner);
            let (key, value) = (self.name(&inner.take(Rule::key)), self.value(inner.last()));
            list.push(Arg { before: std::mem::take(&mut notes), key, value, after: None });
        }
        Args { list, end: notes, span }
    }

    fn value(&self, pair: Node) -> Value {
        let pair = Children::of(pair).last();
        match pair.as_rule() {
            Rule::string => Value::Text(self.string(&pair)),
            Rule::point => Value::Point(self.point(pair)),
            Rule::extent => {
                let span = self.span(&pair);
                let inner = Children::of(pair);
                let sides: Vec<u64> =
                    inner.all(Rule::integer).iter().map(|p| p.as_str().parse().unwrap_or(u64::MAX)).collect();
                Value::Extent { width: sides[0], height: sides[1], unit: self.unit(&inner), span }
            }
            Rule::thread => Value::Dim(self.thread(&pair)),
            _ => Value::Dim(self.dim(pair)),
        }
    }

    /// `M2.5`, `M36 x 3`: one word, although a name holds neither points nor blanks.
    fn thread(&self, pair: &Node) -> Dim {
        let span = self.span(pair);
        let name = Name { text: pair.as_str().replace(' ', ""), span };
        let path = Path { segments: vec![Segment { name, index: None }], span };
        Dim { size: Size::Path(path), tolerance: None, each: false, span }
    }

    fn point(&self, pair: Node) -> Point {
        let span = self.span(&pair);
        let inner = Children::of(pair);
        Point { dims: inner.all(Rule::dim).into_iter().map(|p| self.dim(p)).collect(), unit: self.unit(&inner), span }
    }

    fn dim(&self, pair: Node) -> Dim {
        let span = self.span(&pair);
        let inner = Children::of(pair);
        let size = match inner.first() {
            p if p.as_rule() == Rule::states => self.states(p),
            p if p.as_rule() == Rule::quantity => Size::Quantity(self.quantity(p)),
            p if p.as_rule() == Rule::sum_group => Size::Sum(self.sum(Children::of(p).last())),
            p => Size::Path(self.path(p)),
        };
        let tolerance = inner.0.iter().skip(1).find_map(|p| self.tolerance(p));
        Dim { size, tolerance, each: inner.find(Rule::each).is_some(), span }
    }

    fn states(&self, pair: Node) -> Size {
        let inner = Children::of(pair);
        let state = |p: Node| {
            let inner = Children::of(p);
            (self.name(&inner.take(Rule::state_name)), self.quantity(inner.take(Rule::quantity)))
        };
        Size::States { states: inner.all(Rule::state).into_iter().map(state).collect(), unit: self.unit(&inner) }
    }

    fn tolerance(&self, pair: &Node) -> Option<Tolerance> {
        let inner = Children::of(pair.clone());
        Some(match pair.as_rule() {
            Rule::plus_minus => Tolerance::PlusMinus(self.quantity(inner.last())),
            Rule::limits => Tolerance::Limits(self.quantity(inner.last())),
            Rule::fit => Tolerance::Fit(self.name(pair)),
            Rule::basic => Tolerance::Basic,
            Rule::deviations => {
                let [upper, lower] = [0, 1].map(|i| number(&inner.all(Rule::number)[i]));
                Tolerance::Deviations { upper, lower, unit: self.unit(&inner) }
            }
            _ => return None,
        })
    }

    fn quantity(&self, pair: Node) -> Quantity {
        let span = self.span(&pair);
        let inner = Children::of(pair);
        Quantity { number: number(&inner.take(Rule::number)), unit: self.unit(&inner), span }
    }

    fn unit(&self, inner: &Children) -> Option<Name> {
        let pair = inner.find(Rule::unit)?;
        let text = match pair.as_str() {
            "°" => "deg",
            "µm" | "μm" => "um",
            text => text,
        };
        Some(Name { text: text.to_string(), span: self.span(&pair) })
    }

    /// Left to right, as precedence has already been settled by the grammar.
    fn sum(&self, pair: Node) -> Sum {
        let mut inner = pair.into_inner();
        let mut left = inner.next().map_or_else(nothing, |p| self.operand(p));
        while let (Some(operator), Some(right)) = (inner.next(), inner.next()) {
            let sign = operator.as_str().chars().next().unwrap_or('+');
            left = Sum::Binary(sign, Box::new(left), Box::new(self.operand(right)));
        }
        left
    }

    fn operand(&self, pair: Node) -> Sum {
        match pair.as_rule() {
            Rule::product => self.sum(pair),
            Rule::factor => {
                let inner = Children::of(pair);
                let value = self.operand(inner.last());
                if inner.find(Rule::minus).is_some() { Sum::Negative(Box::new(value)) } else { value }
            }
            Rule::sum_group => Sum::Group(Box::new(self.sum(Children::of(pair).last()))),
            Rule::quantity => Sum::Quantity(self.quantity(pair)),
            _ => Sum::Path(self.path(pair)),
        }
    }

    fn path(&self, pair: Node) -> Path {
        let span = self.span(&pair);
        let segments = Children::of(pair).all(Rule::segment).into_iter().map(|p| self.segment(p));
        Path { segments: segments.collect(), span }
    }

    fn segment(&self, pair: Node) -> Segment {
        let inner = Children::of(pair);
        let index = inner.find(Rule::index).map(|p| {
            let span = self.span(&p);
            let mut ends =
                Children::of(p).all(Rule::integer).into_iter().map(|p| p.as_str().parse().unwrap_or(u64::MAX));
            Index { first: ends.next().unwrap_or(0), last: ends.next(), span }
        });
        Segment { name: self.name(&inner.take(Rule::name)), index }
    }
}

fn number(pair: &Node) -> Number {
    let text = pair.as_str().replace('−', "-");
    // A syntactically valid number parses; one too large becomes infinite and is reported where it is used.
    let value = text.parse().unwrap_or(f64::NAN);
    Number { text, value }
}

fn nothing() -> Sum {
    Sum::Path(Path { segments: Vec::new(), span: Span::default() })
}

/// The pairs inside a pair, found by rule. The grammar guarantees those that are taken.
struct Children<'i>(Vec<Node<'i>>);

impl<'i> Children<'i> {
    fn of(pair: Node<'i>) -> Self {
        Children(pair.into_inner().collect())
    }

    fn all(&self, rule: Rule) -> Vec<Node<'i>> {
        self.0.iter().filter(|p| p.as_rule() == rule).cloned().collect()
    }

    fn find(&self, rule: Rule) -> Option<Node<'i>> {
        self.0.iter().find(|p| p.as_rule() == rule).cloned()
    }

    fn take(&self, rule: Rule) -> Node<'i> {
        self.find(rule).unwrap_or_else(|| unreachable!("the grammar has {rule:?} here"))
    }

    fn first(&self) -> Node<'i> {
        self.0.first().cloned().unwrap_or_else(|| unreachable!("the grammar has a child here"))
    }

    fn last(&self) -> Node<'i> {
        self.0.last().cloned().unwrap_or_else(|| unreachable!("the grammar has a child here"))
    }

    fn text(&mut self, rule: Rule) -> &'i str {
        self.take(rule).as_str()
    }
}
