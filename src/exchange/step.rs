//! STEP: exact solids for CAD systems, ISO 10303-21 text of the application protocol AP242.
//!
//! In: a [`KitPart`] or a whole [`Kit`]. Out: the text of a file, lengths in mm, angles in rad. AP242, for it is what AP203 and
//! AP214 were merged into; of it only what those two have as well is used, so that older readers find their way.
//! Faces bear the names of the features' sides, products those of parts, occurrences those of components. Never rounds a
//! number: a reader gets the kernel's own.

use super::part21::{Data, Id, entity, list, logical, real, reals, string};
use super::polar::{Polar, frame_about};
use super::skin::{Loop, Panel, Skin};
use super::track::Track;
use super::{Kit, KitPart, Paint};
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

const SCHEMA: &str = "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 1 1 4 }";
const PROTOCOL: &str = "ap242_managed_model_based_3d_engineering";
/// Year of the first edition of AP242.
const PROTOCOL_YEAR: u32 = 2014;
/// How near points that are meant to be one may lie apart, mm: ten times what the kernel welds.
const UNCERTAINTY: f64 = 1e-5;

/// One part, in its own frame.
pub fn part(part: &KitPart) -> String {
    let mut file = File::new();
    let product = file.product(&part.name);
    file.part_shape(part, product);
    file.finish(&part.name)
}

/// The assembly: every part once, and its occurrences at their places.
pub fn assembly(kit: &Kit) -> String {
    let mut file = File::new();
    let top = file.product(&kit.name);
    let parts: Vec<Shaped> = kit
        .parts
        .iter()
        .map(|part| {
            let product = file.product(&part.name);
            file.part_shape(part, product)
        })
        .collect();
    let places: Vec<Id> = kit.placed.iter().map(|c| file.placement(&c.pose)).collect();
    let origin = file.origin;
    let items: Vec<Id> = std::iter::once(origin).chain(places.iter().copied()).collect();
    let context = file.context;
    let name = string(&kit.name);
    let whole = entity!(file.data, "SHAPE_REPRESENTATION({name},{},{context})", list(&items));
    entity!(file.data, "SHAPE_DEFINITION_REPRESENTATION({},{whole})", top.shape);
    for (i, (component, place)) in kit.placed.iter().zip(places).enumerate() {
        file.occurrence(i + 1, &component.name, (top, whole), parts[component.part], place);
    }
    file.finish(&kit.name)
}

/// What the entities of a product are called.
#[derive(Clone, Copy)]
struct Product {
    definition: Id,
    shape: Id,
}

#[derive(Clone, Copy)]
struct Shaped {
    product: Product,
    representation: Id,
}

/// A file while it is written: the entities that all others refer to, and the colours at its end.
struct File {
    data: Data,
    context: Id,
    product_context: Id,
    design_context: Id,
    /// The frame that every part is drawn in.
    origin: Id,
    styled: Vec<Id>,
}

impl File {
    fn new() -> File {
        let mut data = Data::default();
        let application = entity!(data, "APPLICATION_CONTEXT('managed model based 3d engineering')");
        entity!(
            data,
            "APPLICATION_PROTOCOL_DEFINITION('international standard','{PROTOCOL}',{PROTOCOL_YEAR},{application})"
        );
        let product_context = entity!(data, "PRODUCT_CONTEXT('',{application},'mechanical')");
        let design_context = entity!(data, "PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')");
        let context = units(&mut data);
        let origin = placement(&mut data, &Isometry3::identity());
        File { data, context, product_context, design_context, origin, styled: Vec::new() }
    }

    /// A product without a shape so far.
    fn product(&mut self, name: &str) -> Product {
        let (data, name) = (&mut self.data, string(name));
        let product = entity!(data, "PRODUCT({name},{name},'',({}))", self.product_context);
        entity!(data, "PRODUCT_RELATED_PRODUCT_CATEGORY('part',$,({product}))");
        let formation = entity!(data, "PRODUCT_DEFINITION_FORMATION('','',{product})");
        let definition = entity!(data, "PRODUCT_DEFINITION('design','',{formation},{})", self.design_context);
        let shape = entity!(data, "PRODUCT_DEFINITION_SHAPE('','',{definition})");
        Product { definition, shape }
    }

    fn part_shape(&mut self, part: &KitPart, product: Product) -> Shaped {
        let mut items = vec![self.origin];
        items.extend(Body::new(&mut self.data, &part.solid).map(|mut body| body.solid(&part.name)));
        for solid in &items[1..] {
            let style = paint(&mut self.data, &part.paint, *solid);
            self.styled.push(style);
        }
        let (data, name) = (&mut self.data, string(&part.name));
        let representation =
            entity!(data, "ADVANCED_BREP_SHAPE_REPRESENTATION({name},{},{})", list(&items), self.context);
        entity!(data, "SHAPE_DEFINITION_REPRESENTATION({},{representation})", product.shape);
        Shaped { product, representation }
    }

    fn placement(&mut self, pose: &Isometry3<f64>) -> Id {
        placement(&mut self.data, pose)
    }

    fn occurrence(&mut self, number: usize, name: &str, (top, whole): (Product, Id), part: Shaped, place: Id) {
        let (data, name) = (&mut self.data, string(name));
        let (above, below) = (top.definition, part.product.definition);
        let usage = entity!(data, "NEXT_ASSEMBLY_USAGE_OCCURRENCE('{number}',{name},'',{above},{below},$)");
        let shape = entity!(data, "PRODUCT_DEFINITION_SHAPE('Placement','Placement of an item',{usage})");
        let moved = entity!(data, "ITEM_DEFINED_TRANSFORMATION('','',{},{place})", self.origin);
        let relation = entity!(
            data,
            "(REPRESENTATION_RELATIONSHIP('','',{},{whole})REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({moved})\
             SHAPE_REPRESENTATION_RELATIONSHIP())",
            part.representation
        );
        entity!(data, "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({relation},{shape})");
    }

    fn finish(mut self, name: &str) -> String {
        if !self.styled.is_empty() {
            let (styled, context) = (list(&self.styled), self.context);
            entity!(self.data, "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{styled},{context})");
        }
        self.data.file(name, SCHEMA)
    }
}

/// Millimetres, radians, and how exact the geometry is.
fn units(data: &mut Data) -> Id {
    let length = entity!(data, "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
    let angle = entity!(data, "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    let solid_angle = entity!(data, "(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let uncertainty = entity!(
        data,
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{length},'distance_accuracy_value','confusion accuracy')",
        real(UNCERTAINTY)
    );
    entity!(
        data,
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({uncertainty}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid_angle}))REPRESENTATION_CONTEXT('',''))"
    )
}

/// Colours an item.
fn paint(data: &mut Data, paint: &Paint, item: Id) -> Id {
    let [r, g, b] = paint.srgb().map(real);
    let colour = entity!(data, "COLOUR_RGB('',{r},{g},{b})");
    let area = entity!(data, "FILL_AREA_STYLE_COLOUR('',{colour})");
    let area = entity!(data, "FILL_AREA_STYLE('',({area}))");
    let fill = entity!(data, "SURFACE_STYLE_FILL_AREA({area})");
    let side = entity!(data, "SURFACE_SIDE_STYLE('',({fill}))");
    let usage = entity!(data, "SURFACE_STYLE_USAGE(.BOTH.,{side})");
    let style = entity!(data, "PRESENTATION_STYLE_ASSIGNMENT(({usage}))");
    entity!(data, "STYLED_ITEM('color',({style}),{item})")
}

fn point(data: &mut Data, p: &Point3<f64>) -> Id {
    entity!(data, "CARTESIAN_POINT('',{})", reals([p.x, p.y, p.z]))
}

fn direction(data: &mut Data, d: &Vector3<f64>) -> Id {
    entity!(data, "DIRECTION('',{})", reals([d.x, d.y, d.z]))
}

fn placement(data: &mut Data, frame: &Isometry3<f64>) -> Id {
    let origin = Point3::from(frame.translation.vector);
    axes(data, &origin, &(frame.rotation * Vector3::z()), &(frame.rotation * Vector3::x()))
}

fn axes(data: &mut Data, origin: &Point3<f64>, z: &Vector3<f64>, x: &Vector3<f64>) -> Id {
    let (origin, z, x) = (point(data, origin), direction(data, z), direction(data, x));
    entity!(data, "AXIS2_PLACEMENT_3D('',{origin},{z},{x})")
}

/// The geometry and topology of one solid.
struct Body<'a> {
    data: &'a mut Data,
    solid: &'a Solid,
    skin: Skin,
    vertices: Vec<Id>,
    edges: Vec<Id>,
}

impl<'a> Body<'a> {
    fn new(data: &'a mut Data, solid: &'a Solid) -> Option<Self> {
        let skin = Skin::new(solid)?;
        let mut body = Body { data, solid, skin, vertices: Vec::new(), edges: Vec::new() };
        body.vertices = (0..body.skin.points.len()).map(|i| body.vertex(i)).collect();
        body.edges = (0..body.skin.rims.len()).map(|i| body.edge(i)).collect();
        Some(body)
    }

    fn vertex(&mut self, i: usize) -> Id {
        let at = point(self.data, &self.skin.points[i]);
        entity!(self.data, "VERTEX_POINT('',{at})")
    }

    fn edge(&mut self, i: usize) -> Id {
        let rim = &self.skin.rims[i];
        let [from, to] = rim.ends.map(|v| self.vertices[v]);
        let curve = curve(self.data, &rim.track);
        entity!(self.data, "EDGE_CURVE('',{from},{to},{curve},.T.)")
    }

    /// The solid, with its voids if it has any.
    fn solid(&mut self, name: &str) -> Id {
        let shells = self.skin.shells.clone();
        let mut written = shells.iter().enumerate().map(|(i, s)| self.shell(s, i > 0)).collect::<Vec<_>>();
        let (outer, name) = (written.remove(0), string(name));
        if written.is_empty() {
            return entity!(self.data, "MANIFOLD_SOLID_BREP({name},{outer})");
        }
        let voids: Vec<Id> =
            written.into_iter().map(|s| entity!(self.data, "ORIENTED_CLOSED_SHELL('',*,{s},.F.)")).collect();
        entity!(self.data, "BREP_WITH_VOIDS({name},{outer},{})", list(&voids))
    }

    /// A shell; that of a void is written as the boundary of the void, and reversed where the solid uses it.
    fn shell(&mut self, panels: &[usize], void: bool) -> Id {
        let faces: Vec<Id> = panels.iter().map(|p| self.face(*p, void)).collect();
        entity!(self.data, "CLOSED_SHELL('',{})", list(&faces))
    }

    fn face(&mut self, panel: usize, void: bool) -> Id {
        let Panel { face, polar, loops } = self.skin.panels[panel].clone();
        let bounds: Vec<Id> = match &polar {
            Some(polar) if loops.is_empty() => vec![self.whole(polar)],
            _ => loops.iter().enumerate().map(|(i, l)| self.bound(l, i == 0, !void)).collect(),
        };
        let surface = surface(self.data, self.solid.surface(face), polar.as_ref(), self.reach(&loops));
        let face = &self.solid.faces[face];
        let (name, sense) = (string(&face.name), logical(face.outward != void));
        entity!(self.data, "ADVANCED_FACE({name},{},{surface},{sense})", list(&bounds))
    }

    fn bound(&mut self, halves: &Loop, outer: bool, forward: bool) -> Id {
        let (data, edges) = (&mut self.data, &self.edges);
        let oriented = |&(rim, forward): &(usize, bool)| {
            entity!(data, "ORIENTED_EDGE('',*,*,{},{})", edges[rim], logical(forward))
        };
        let sides: Vec<Id> = halves.iter().map(oriented).collect();
        let path = entity!(self.data, "EDGE_LOOP('',{})", list(&sides));
        let kind = if outer { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
        entity!(self.data, "{kind}('',{path},{})", logical(forward))
    }

    /// The bound of a sphere without an edge: one of its poles.
    fn whole(&mut self, polar: &Polar) -> Id {
        let at = polar.pole(0).unwrap_or_else(Point3::origin);
        let at = point(self.data, &at);
        let vertex = entity!(self.data, "VERTEX_POINT('',{at})");
        let path = entity!(self.data, "VERTEX_LOOP('',{vertex})");
        entity!(self.data, "FACE_BOUND('',{path},.T.)")
    }

    /// The corner of a face that is farthest from the origin of its surface along the axis tells where a cone is wide.
    fn reach(&self, loops: &[Loop]) -> Vec<Point3<f64>> {
        let ends = loops.iter().flatten().map(|(rim, _)| self.skin.rims[*rim].ends[0]);
        ends.map(|v| self.skin.points[v]).collect()
    }
}

fn surface(data: &mut Data, surface: &Surface, polar: Option<&Polar>, corners: Vec<Point3<f64>>) -> Id {
    let frame = polar.map_or_else(|| surface.frame(), |p| *p.frame());
    match surface {
        Surface::Plane { .. } => {
            let at = placement(data, &frame);
            entity!(data, "PLANE('',{at})")
        }
        Surface::Cylinder { radius, .. } => {
            let at = placement(data, &frame);
            entity!(data, "CYLINDRICAL_SURFACE('',{at},{})", real(*radius))
        }
        Surface::Cone { apex, axis, half_angle } => {
            // Placed where the face is widest: a cone placed at its apex would have the radius zero.
            let rise = corners.iter().map(|p| (p - apex).dot(axis)).fold(0.0, f64::max);
            let at = placement(data, &frame_about(apex + axis.into_inner() * rise, *axis));
            entity!(data, "CONICAL_SURFACE('',{at},{},{})", real(rise * half_angle.tan()), real(*half_angle))
        }
        Surface::Sphere { radius, .. } => {
            let at = placement(data, &frame);
            entity!(data, "SPHERICAL_SURFACE('',{at},{})", real(*radius))
        }
        Surface::Torus { major, minor, .. } if major > minor => {
            let at = placement(data, &frame);
            entity!(data, "TOROIDAL_SURFACE('',{at},{},{})", real(*major), real(*minor))
        }
        Surface::Torus { major, minor, .. } => {
            let at = placement(data, &frame);
            let (outer, major) = (logical(*major >= 0.0), real(major.abs()));
            entity!(data, "DEGENERATE_TOROIDAL_SURFACE('',{at},{major},{},{outer})", real(*minor))
        }
    }
}

fn curve(data: &mut Data, track: &Track) -> Id {
    match track {
        Track::Line { from, to } => {
            let along = Unit::try_new(to - from, f64::MIN_POSITIVE).unwrap_or_else(Vector3::x_axis);
            let (from, along) = (point(data, from), direction(data, &along));
            let vector = entity!(data, "VECTOR('',{along},1.)");
            entity!(data, "LINE('',{from},{vector})")
        }
        Track::Arc { centre, x, y, from, .. } => arc(data, centre, x, y, *from),
        Track::Spline { knots, points, slopes } => spline(data, knots, points, slopes),
    }
}

/// Half axes whose lengths differ by a smaller share are equal: the arc is of a circle.
const ROUND: f64 = 1e-12;

fn arc(data: &mut Data, centre: &Point3<f64>, x: &Vector3<f64>, y: &Vector3<f64>, from: f64) -> Id {
    let axis = x.cross(y).normalize();
    let (a, b) = (x.norm(), y.norm());
    if (a - b).abs() <= ROUND * a {
        let start = x * from.cos() + y * from.sin();
        let at = axes(data, centre, &axis, &start.normalize());
        return entity!(data, "CIRCLE('',{at},{})", real(a));
    }
    // The longer half axis first: some readers insist.
    let (x, a, b) = if a > b { (*x, a, b) } else { (*y, b, a) };
    let at = axes(data, centre, &axis, &x.normalize());
    entity!(data, "ELLIPSE('',{at},{},{})", real(a), real(b))
}

/// A cubic B-spline with the same pieces: every inner knot twice, for the first derivative is continuous and no more.
fn spline(data: &mut Data, knots: &[f64], points: &[Point3<f64>], slopes: &[Vector3<f64>]) -> Id {
    let last = knots.len() - 1;
    let mut poles = vec![points[0]];
    for i in 0..last {
        let third = (knots[i + 1] - knots[i]) / 3.0;
        poles.extend([points[i] + slopes[i] * third, points[i + 1] - slopes[i + 1] * third]);
    }
    poles.push(points[last]);
    let poles: Vec<Id> = poles.iter().map(|p| point(data, p)).collect();
    let times: Vec<&str> = (0..=last).map(|i| if i == 0 || i == last { "4" } else { "2" }).collect();
    let closed = logical(points[0] == points[last]);
    entity!(
        data,
        "B_SPLINE_CURVE_WITH_KNOTS('',3,{},.UNSPECIFIED.,{closed},.F.,({}),{},.UNSPECIFIED.)",
        list(&poles),
        times.join(","),
        reals(knots.iter().copied())
    )
}
