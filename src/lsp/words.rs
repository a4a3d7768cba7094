//! The arguments and fields of the language, each with a line of documentation: what hovers and completions say.
//!
//! Tests hold them against what the compiler says it takes. What is no argument stands in `keywords`.

pub use super::keywords::{GENERAL, HOLES, KEYWORDS, Keyword, SHAFTS, UNITS};

/// What an argument or a field takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Takes {
    /// mm unless the file says otherwise.
    Length,
    /// A length, or `through` in a cut.
    Depth,
    /// Degrees unless the file says otherwise.
    Angle,
    /// An angle, or `free`.
    Turn,
    Ratio,
    Pixels,
    /// A whole number.
    Whole,
    Point,
    /// `640 x 480 px`
    Image,
    Material,
    Outline,
    OneOf(&'static [&'static str]),
}

impl Takes {
    /// The unit, in words.
    pub fn unit(self) -> &'static str {
        match self {
            Takes::Length => "length, mm",
            Takes::Depth => "length, mm, or `through`",
            Takes::Angle => "angle, deg",
            Takes::Turn => "angle, deg, or `free`",
            Takes::Ratio => "ratio, or %",
            Takes::Pixels => "px",
            Takes::Whole => "whole number",
            Takes::Point => "point `(x, y, z)`, mm",
            Takes::Image => "`640 x 480 px`",
            Takes::Material => "name of a material",
            Takes::Outline => "name of an outline",
            Takes::OneOf(_) => "one of the words",
        }
    }
}

/// An argument of a call, or a field of a block.
#[derive(Debug, Clone, Copy)]
pub struct Argument {
    pub name: &'static str,
    pub takes: Takes,
    pub doc: &'static str,
}

/// What takes arguments or fields: a shape, a pattern, a light, a block.
#[derive(Debug, Clone, Copy)]
pub struct Owner {
    pub name: &'static str,
    pub role: Role,
    pub doc: &'static str,
    pub arguments: &'static [Argument],
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    Shape,
    Pattern,
    Light,
    /// Fields in braces.
    Block,
    /// `watch pin (depth = 2)`
    Options,
}

const fn arg(name: &'static str, takes: Takes, doc: &'static str) -> Argument {
    Argument { name, takes, doc }
}

use Takes::{Angle, Depth, Image, Length, OneOf, Pixels, Point, Ratio, Turn, Whole};

const BORE: Argument = arg("d", Length, "diameter");
const HEIGHT: Argument = arg("h", Depth, "height, from z = 0 up");
const DEEP: Argument = arg("h", Depth, "depth below the face z = 0");
const POWER: Argument = arg("power", Ratio, "radiance beside the other lights, and its drift between photos; 1 ±10 %");
const COLOUR: Argument = arg(
    "colour",
    OneOf(&["white", "blue", "green", "red", "infrared"]),
    "of the light: metals answer each in their own way; white",
);
const AIM: Argument = arg("aim", Point, "the point it is turned to; (0, 0, 0)");

/// All that takes arguments or fields.
pub const OWNERS: &[Owner] = &[
    Owner {
        name: "box",
        role: Role::Shape,
        doc: "a box, centred in x and y, that stands on z = 0",
        arguments: &[
            arg("x", Length, "size along x"),
            arg("y", Length, "size along y"),
            arg("z", Depth, "size along z, from z = 0 up"),
        ],
    },
    Owner {
        name: "cylinder",
        role: Role::Shape,
        doc: "a cylinder about z that stands on z = 0",
        arguments: &[
            BORE,
            HEIGHT,
            arg("chamfer", Length, "45 degree chamfer of both ends"),
            arg("chamfer_top", Length, "45 degree chamfer of the upper end"),
            arg("chamfer_bottom", Length, "45 degree chamfer of the lower end"),
        ],
    },
    Owner { name: "cone", role: Role::Shape, doc: "a cone or frustum about z that stands on z = 0", arguments: CONE },
    Owner { name: "frustum", role: Role::Shape, doc: "a frustum about z that stands on z = 0", arguments: CONE },
    Owner { name: "sphere", role: Role::Shape, doc: "a sphere, centred on the origin", arguments: &[BORE] },
    Owner {
        name: "torus",
        role: Role::Shape,
        doc: "a ring about z, centred on the origin",
        arguments: &[
            arg("d", Length, "diameter of the circle that the tube follows"),
            arg("tube", Length, "diameter of the tube"),
        ],
    },
    Owner {
        name: "prism",
        role: Role::Shape,
        doc: "an outline in x and y, extruded from z = 0 up",
        arguments: &[arg("outline", Takes::Outline, "the outline, drawn in this part"), HEIGHT],
    },
    Owner {
        name: "revolve",
        role: Role::Shape,
        doc: "an outline in x (the distance from the axis) and z, turned about z",
        arguments: &[arg("outline", Takes::Outline, "the outline, drawn in this part")],
    },
    Owner {
        name: "hole",
        role: Role::Shape,
        doc: "a drilled hole: goes down from the face z = 0; faces `bore.side`, `bore.bottom`, `point.side`",
        arguments: &[BORE, DEEP, arg("tip", Angle, "angle of the drill's point below that depth")],
    },
    Owner {
        name: "counterbore",
        role: Role::Shape,
        doc: "a hole with a flat seat for a head: goes down from the face z = 0",
        arguments: &[
            BORE,
            DEEP,
            arg("head_d", Length, "diameter of the seat"),
            arg("head_h", Length, "depth of the seat below the face"),
        ],
    },
    Owner {
        name: "countersink",
        role: Role::Shape,
        doc: "a hole with a conical seat for a head: goes down from the face z = 0",
        arguments: &[
            BORE,
            DEEP,
            arg("head_d", Length, "diameter of the cone in the face"),
            arg("angle", Angle, "angle of the cone; 90 deg"),
        ],
    },
    Owner {
        name: "circle",
        role: Role::Pattern,
        doc: "copies on a circle, counter-clockwise about +z, each turned with its place",
        arguments: &[
            arg("d", Length, "diameter of the circle"),
            arg("r", Length, "radius of the circle, instead of `d`"),
            arg("from", Angle, "where the first copy stands, from +x; 0"),
            arg("step", Angle, "from copy to copy; a whole turn divided by the count"),
        ],
    },
    Owner {
        name: "line",
        role: Role::Pattern,
        doc: "copies on a line, from the feature's place on",
        arguments: &[
            arg("pitch", Length, "from copy to copy"),
            arg("angle", Angle, "direction of the line, from +x; 0"),
        ],
    },
    Owner {
        name: "grid",
        role: Role::Pattern,
        doc: "copies on a grid centred on the feature's place, in reading order",
        arguments: &[
            arg("columns", Whole, "copies in a row"),
            arg("x", Length, "from column to column"),
            arg("y", Length, "from row to row"),
        ],
    },
    Owner {
        name: "ring",
        role: Role::Light,
        doc: "a ring light round the lens",
        arguments: &[
            arg("inner", Length, "inner radius; 30 mm"),
            arg("outer", Length, "outer radius; inner + 20 mm"),
            arg("setback", Length, "distance behind the front of the lens; 0"),
            POWER,
            COLOUR,
        ],
    },
    Owner { name: "panel", role: Role::Light, doc: "a flat panel", arguments: PANEL },
    Owner { name: "bar", role: Role::Light, doc: "a bar light", arguments: PANEL },
    Owner {
        name: "room",
        role: Role::Light,
        doc: "light from the whole upper hemisphere",
        arguments: &[
            arg("patches", Whole, "patches of equal solid angle, each with a power of its own; 9"),
            POWER,
            COLOUR,
        ],
    },
    Owner {
        name: "material",
        role: Role::Block,
        doc: "how a surface answers light; ranges are drawn for every piece and image",
        arguments: &[
            arg("kind", OneOf(&["metal", "plastic", "matt"]), "metal, plastic (under a clear coat) or matt; matt"),
            arg("metal", OneOf(&["steel", "aluminium", "brass", "copper"]), "sets `n` and `k`; steel"),
            arg("n", Ratio, "refractive index, real part; of the metal"),
            arg("k", Ratio, "refractive index, imaginary part; of the metal"),
            arg(
                "reflectance",
                Ratio,
                "factor on a metal's reflection, albedo of the others; 0.4 .. 0.7, or 0.1 .. 0.4",
            ),
            arg("roughness", Ratio, "GGX alpha; metal 0.06 .. 0.3, plastic 0.1 .. 0.3"),
            arg("edge_break", Length, "width of the rounding of convex edges; 0.05 .. 0.2 mm"),
            arg("mottle", Ratio, "relative amplitude of blotches and grain; 0"),
            arg("mottle_size", Length, "size of the blotches, or `(x, y, z)` for grain; 8 mm"),
            arg(
                "lay",
                OneOf(&["none", "circular", "x", "y", "z"]),
                "grooves of machining on a metal: round the axis of each face, or along an axis of the part; none",
            ),
            arg("lay_roughness", Ratio, "roughness along the grooves as a share of that across them; 0.3"),
        ],
    },
    Owner {
        name: "part",
        role: Role::Block,
        doc: "a part: its material and its features, from top to bottom",
        arguments: &[arg("material", Takes::Material, "what the part is made of")],
    },
    Owner {
        name: "place",
        role: Role::Block,
        doc: "puts pieces of a part on a component or on one of its features",
        arguments: &[
            arg("x", Length, "place along x of the support's frame; 0"),
            arg("y", Length, "place along y of the support's frame; 0"),
            arg("z", Length, "place along z of the support's frame; 0"),
            arg("rx", Turn, "turn about x, first; 0"),
            arg("ry", Turn, "turn about y, second; 0"),
            arg("rz", Turn, "turn about z, last; 0"),
        ],
    },
    Owner {
        name: "camera",
        role: Role::Block,
        doc: "the camera: `fixed`, or `auto` within ranges among which the compiler chooses; several have a name each: \
              `camera top fixed`",
        arguments: &[
            arg("image", Image, "size of the image; 640 x 480 px"),
            arg("focal", Length, "focal length; 16 mm ±0.5 %"),
            arg("pitch", Length, "distance of two pixels on the sensor; 0.0074 mm"),
            arg("aim", Point, "the point looked at, in the assembly's frame; (0, 0, 0)"),
            arg("distance", Length, "from there to the camera; 300 mm"),
            arg("elevation", Angle, "above the horizon; 90 deg"),
            arg("azimuth", Angle, "where the camera stands, from +x towards +y; -90 deg"),
            arg("k1", Ratio, "radial distortion, radius in half image widths; 0"),
            arg("k2", Ratio, "its next term, with the fourth power of the radius; 0"),
            arg("vignetting", Ratio, "share of light that the lens loses in the corners; 0"),
            arg("offset", Length, "error of the installation in each axis; 0 ±1 mm"),
            arg("tilt", Angle, "error of the installation about each axis; 0 ±0.3 deg"),
            arg("blur", Pixels, "standard deviation of the point spread, a range if photos differ; 0.5 px"),
            arg("response", OneOf(&["linear", "srgb"]), "of the sensor to light; linear"),
            arg("full_well", Ratio, "electrons at full scale, for shot noise; none"),
            arg("depth", Whole, "bits of a grey value, 8 to 16; 8"),
        ],
    },
    Owner {
        name: "floor",
        role: Role::Block,
        doc: "the endless plane that the assembly stands on",
        arguments: &[
            arg("z", Length, "height in the assembly's frame; 0"),
            arg("material", Takes::Material, "of the floor"),
        ],
    },
    Owner {
        name: "vary",
        role: Role::Block,
        doc: "what varies from photo to photo",
        arguments: &[
            arg("x", Length, "place of the assembly; 0"),
            arg("y", Length, "place of the assembly; 0"),
            arg("z", Length, "place of the assembly; 0"),
            arg("rz", Angle, "turn of the assembly about z; 0"),
            arg("exposure", Ratio, "factor on a photo's light, a range if photos differ; 1"),
            arg("noise", Ratio, "standard deviation of the sensor's noise, share of full scale; 0.5 %"),
        ],
    },
    Owner {
        name: "inspect",
        role: Role::Block,
        doc: "what the inspector answers for",
        arguments: &[arg("false_reject", Ratio, "share of good assemblies that may be rejected; 0.1 %")],
    },
    Owner {
        name: "train",
        role: Role::Block,
        doc: "how hard to train",
        arguments: &[
            arg("images", Whole, "draws of the assembly per scene; 14"),
            arg("seed", Whole, "of all random draws; 1"),
            arg("levels", Whole, "resolutions per node, each half as fine as the one before; 4"),
            arg("samples", Whole, "per pixel; 16"),
            arg("draw", OneOf(&["uniform", "nominal"]), "between the limits, or with the mode at nominal; uniform"),
        ],
    },
    Owner {
        name: "watch",
        role: Role::Options,
        doc: "watches a component, with so many levels of its error tree",
        arguments: &[arg("depth", Whole, "levels of the error tree; visibility decides")],
    },
];

const CONE: &[Argument] = &[
    arg("d1", Length, "diameter at z = 0; 0 makes a point"),
    arg("d2", Length, "diameter at z = h; 0 makes a point"),
    arg("h", Length, "height, from z = 0 up"),
];

const PANEL: &[Argument] = &[
    arg("width", Length, "across, horizontal"),
    arg("height", Length, "upright"),
    arg("at", Point, "its centre, in the assembly's frame"),
    AIM,
    POWER,
    COLOUR,
];

/// What takes arguments under that name in that role.
pub fn owner(name: &str, roles: &[Role]) -> Option<&'static Owner> {
    OWNERS.iter().find(|o| o.name == name && roles.contains(&o.role))
}

impl Owner {
    pub fn argument(&self, name: &str) -> Option<&'static Argument> {
        self.arguments.iter().find(|a| a.name == name)
    }

    /// `cylinder(d, h, chamfer)`
    pub fn signature(&self) -> String {
        let names: Vec<&str> = self.arguments.iter().map(|a| a.name).collect();
        format!("{}({})", self.name, names.join(", "))
    }
}
