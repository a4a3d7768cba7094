//! The parts of judging a photo, told to whoever times them.
//!
//! In: nothing. Out: nothing but the names. A result never depends on being listened to, and no clock is read here.

/// What judging is busy with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// The bytes of an image file become pixels.
    Decode,
    /// Grey values become light, the lens's shading is taken off.
    Light,
    /// The photo at the locator's resolutions, with the direction of every edge at the coarsest.
    Fields,
    /// All poses of the grid are compared with the edges.
    Poses,
    /// The best poses follow their edges to a fraction of a px.
    Edges,
    /// Nodes are cut from the photo at every shift, with their integral images and Haar coefficients.
    Windows,
    /// Every shift under Gaussian noise, for every hypothesis.
    Shifts,
    /// The best shifts under heavy tails.
    Likelihood,
    /// Whether a node looks like nothing the model knows.
    Unknown,
    /// Whether one fault explains what other nodes show.
    Explain,
    /// What is left: scores, boxes and sentences.
    Verdict,
}

impl Part {
    /// In the order in which they begin.
    pub const ALL: [Part; 11] = [
        Part::Decode,
        Part::Light,
        Part::Fields,
        Part::Poses,
        Part::Edges,
        Part::Windows,
        Part::Shifts,
        Part::Likelihood,
        Part::Unknown,
        Part::Explain,
        Part::Verdict,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Part::Decode => "decode",
            Part::Light => "light",
            Part::Fields => "fields",
            Part::Poses => "poses",
            Part::Edges => "edges",
            Part::Windows => "windows",
            Part::Shifts => "shifts",
            Part::Likelihood => "likelihood",
            Part::Unknown => "unknown",
            Part::Explain => "explain",
            Part::Verdict => "verdict",
        }
    }
}

/// Told when a part begins, which ends the one before it. Parts come again and again.
pub type Listener<'a> = dyn Fn(Part) + Sync + 'a;

/// Listens to nothing.
pub fn nobody(_: Part) {}
