//! The syntax tree: what was written, in the order it was written, with spans and comments.
//!
//! Nothing is resolved here: a number keeps its digits and its unit, a name is only a name. Serialising a tree leaves its
//! spans out, so two files that differ in layout alone serialise alike.

use crate::diag::Span;
use serde::Serialize;

/// One source file.
#[derive(Debug, Clone, Default, Serialize)]
pub struct File {
    pub lines: Vec<Line>,
    /// Comments and blank lines after the last item.
    pub end: Vec<Gap>,
    /// What could not be read and is reported: names that stand here are not unknown.
    #[serde(skip)]
    pub lost: Vec<Span>,
}

/// A statement with the comments that belong to it.
#[derive(Debug, Clone, Serialize)]
pub struct Line {
    /// Comments and blank lines above.
    pub before: Vec<Gap>,
    pub stmt: Stmt,
    /// Comment behind the statement, on its line.
    pub after: Option<String>,
    #[serde(skip)]
    pub span: Span,
}

/// What stands between two statements.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub enum Gap {
    Blank,
    /// With its slashes.
    Comment(String),
}

/// The lines between two braces.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Body {
    /// Comment behind the opening brace.
    pub open: Option<String>,
    pub lines: Vec<Line>,
    pub end: Vec<Gap>,
}

#[derive(Debug, Clone, Serialize)]
pub enum Stmt {
    Version(u64),
    /// Length and angle.
    Units(Name, Name),
    Tolerances(Name),
    Use(Name),
    Let {
        name: Name,
        dim: Dim,
    },
    Material {
        name: Name,
        body: Body,
    },
    Part {
        name: Name,
        body: Body,
    },
    /// `part iso2338(d, l) { … }`: a part drawn once for many sizes.
    Family {
        name: Name,
        params: Vec<Name>,
        body: Body,
    },
    /// `part pin = iso2338(d = 6, l = 20)`
    Member {
        name: Name,
        call: Call,
    },
    /// `table d (k, s) { … }` of a family, with a column of cells for each name.
    Table {
        name: Name,
        columns: Vec<Name>,
        body: Body,
    },
    /// `row M6 = (5.82 .. 6, 10)`
    Row {
        key: Name,
        cells: Vec<Dim>,
    },
    Feature(Box<Feature>),
    Outline {
        name: Name,
        body: Body,
    },
    /// `from (0, 0)`: where an outline begins.
    Start {
        at: Point,
        corner: Option<Corner>,
    },
    Side(Box<Side>),
    Assembly {
        name: Name,
        body: Body,
    },
    /// `root base = plate`; without `= plate` the part has the component's name.
    Root {
        name: Name,
        part: Option<Name>,
    },
    Place(Box<Place>),
    Measure(Box<Measure>),
    Station {
        name: Name,
        body: Body,
    },
    Camera {
        /// Where a station has several.
        name: Option<Name>,
        mode: Option<Name>,
        body: Body,
    },
    Light {
        name: Name,
        call: Call,
    },
    Floor(Body),
    Vary(Body),
    Inspect {
        name: Option<Name>,
        body: Body,
    },
    Watch {
        path: Path,
        args: Option<Args>,
    },
    Ignore(Path),
    Train(Body),
    Field {
        key: Name,
        value: Value,
    },
}

/// A name, or any other single word, with its place.
#[derive(Debug, Clone, Serialize)]
pub struct Name {
    pub text: String,
    #[serde(skip)]
    pub span: Span,
}

/// `cut bore = 3x cylinder(…) at (…) turn (…) on circle(…)`
#[derive(Debug, Clone, Serialize)]
pub struct Feature {
    /// `add`, `cut` or `keep`.
    pub op: Name,
    pub name: Name,
    pub count: Option<Count>,
    pub shape: Shape,
    pub at: Option<Point>,
    pub turn: Option<Point>,
    pub on: Option<Call>,
}

/// What is added or cut.
#[derive(Debug, Clone, Serialize)]
pub enum Shape {
    Call(Call),
    /// `group { … }`, with the place of the word.
    Group {
        word: Name,
        body: Body,
    },
}

impl Shape {
    /// `cylinder`, `group`.
    pub fn word(&self) -> &Name {
        match self {
            Shape::Call(call) => &call.name,
            Shape::Group { word, .. } => word,
        }
    }
}

/// `line base to (40, 0) round 3`
#[derive(Debug, Clone, Serialize)]
pub struct Side {
    pub name: Option<Name>,
    pub to: Point,
    /// `None` for a line.
    pub arc: Option<Arc>,
    pub corner: Option<Corner>,
}

/// `radius 10 left long`
#[derive(Debug, Clone, Serialize)]
pub struct Arc {
    pub radius: Dim,
    /// `left` or `right`.
    pub hand: Name,
    pub long: bool,
}

/// `round 3`, `chamfer 1`
#[derive(Debug, Clone, Serialize)]
pub struct Corner {
    pub kind: CornerKind,
    pub size: Dim,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum CornerKind {
    Round,
    Chamfer,
}

/// `place pin = 3x pin on plate.bore { … }`
#[derive(Debug, Clone, Serialize)]
pub struct Place {
    pub name: Name,
    pub count: Option<Count>,
    pub part: Option<Name>,
    pub on: Path,
    pub body: Option<Body>,
}

/// `measure gap = from plate.slab.top to pin[2].head.bottom within 0.1 .. 0.4`
#[derive(Debug, Clone, Serialize)]
pub struct Measure {
    pub name: Name,
    pub from: Face,
    pub to: Face,
    pub within: Option<Dim>,
}

/// `pin[2].head.bottom`: a component, and the name of a face of its part.
#[derive(Debug, Clone, Serialize)]
pub struct Face {
    pub component: Segment,
    pub face: Name,
    #[serde(skip)]
    pub span: Span,
}

/// `3x`
#[derive(Debug, Clone, Serialize)]
pub struct Count {
    /// The largest number if the digits say more than it holds.
    pub value: u64,
    #[serde(skip)]
    pub span: Span,
}

/// `cylinder(d = 6 H7, h = through)`
#[derive(Debug, Clone, Serialize)]
pub struct Call {
    pub name: Name,
    pub args: Args,
}

#[derive(Debug, Clone, Serialize)]
pub struct Args {
    pub list: Vec<Arg>,
    /// Comments after the last argument.
    pub end: Vec<String>,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Serialize)]
pub struct Arg {
    /// Comments above.
    pub before: Vec<String>,
    pub key: Name,
    pub value: Value,
    /// Comment behind the argument, on its line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<String>,
}

#[derive(Debug, Clone, Serialize)]
pub enum Value {
    Text(Name),
    Point(Point),
    /// `640 x 480 px`
    Extent {
        width: u64,
        height: u64,
        unit: Option<Name>,
        #[serde(skip)]
        span: Span,
    },
    Dim(Dim),
}

impl Value {
    pub fn span(&self) -> Span {
        match self {
            Value::Text(name) => name.span,
            Value::Point(point) => point.span,
            Value::Extent { span, .. } => *span,
            Value::Dim(dim) => dim.span,
        }
    }
}

/// Two or three coordinates.
#[derive(Debug, Clone, Serialize)]
pub struct Point {
    pub dims: Vec<Dim>,
    pub unit: Option<Name>,
    #[serde(skip)]
    pub span: Span,
}

/// A number of the drawing.
#[derive(Debug, Clone, Serialize)]
pub struct Dim {
    pub size: Size,
    pub tolerance: Option<Tolerance>,
    pub each: bool,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Serialize)]
pub enum Size {
    Quantity(Quantity),
    Sum(Sum),
    Path(Path),
    /// `{ mmc 19.8, nominal 20.0, lmc 20.3 }`
    States {
        states: Vec<(Name, Quantity)>,
        unit: Option<Name>,
    },
}

/// A number as written, with its unit.
#[derive(Debug, Clone, Serialize)]
pub struct Quantity {
    pub number: Number,
    pub unit: Option<Name>,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Serialize)]
pub struct Number {
    pub text: String,
    /// Infinite when the digits say more than an `f64` holds.
    #[serde(skip)]
    pub value: f64,
}

#[derive(Debug, Clone, Serialize)]
pub enum Tolerance {
    /// `±0.2`, `±20 %`
    PlusMinus(Quantity),
    /// `+0/-0.1`: upper deviation first.
    Deviations {
        upper: Number,
        lower: Number,
        unit: Option<Name>,
    },
    /// `8.00 .. 8.05`
    Limits(Quantity),
    /// `H7`
    Fit(Name),
    Basic,
}

/// Arithmetic inside parentheses.
#[derive(Debug, Clone, Serialize)]
pub enum Sum {
    Quantity(Quantity),
    Path(Path),
    Negative(Box<Sum>),
    /// Operator: one of `+ - * /`.
    Binary(char, Box<Sum>, Box<Sum>),
    /// Parentheses as written.
    Group(Box<Sum>),
}

/// `plate.bore[2]`
#[derive(Debug, Clone, Serialize)]
pub struct Path {
    pub segments: Vec<Segment>,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Serialize)]
pub struct Segment {
    pub name: Name,
    pub index: Option<Index>,
}

/// `[2]` or `[1..3]`, counted from 1.
#[derive(Debug, Clone, Serialize)]
pub struct Index {
    pub first: u64,
    pub last: Option<u64>,
    #[serde(skip)]
    pub span: Span,
}

impl Path {
    /// The single word this path consists of, if it is one.
    pub fn word(&self) -> Option<&str> {
        match self.segments.as_slice() {
            [Segment { name, index: None }] => Some(&name.text),
            _ => None,
        }
    }
}

impl Dim {
    /// The bare word (`free`, `through`, `srgb`) this value consists of, if it is one.
    pub fn word(&self) -> Option<&str> {
        match (&self.size, &self.tolerance) {
            (Size::Path(path), None) if !self.each => path.word(),
            _ => None,
        }
    }
}
