//! What the viewer turns: meshes with the names of their faces, where components stand, what touches what.
//!
//! In: an assembly. Out: JSON that can stand inside a script element; numbers in bulk as little-endian bytes in base64.

use super::html::{base64, number};
use super::{Assembly, Report, colour};
use crate::assembly::contact::{Contact, ContactKind, Fit};
use crate::assembly::insertion::{self, Insertion};
use crate::drawing::json;
use crate::exchange::{Kit, KitPart};
use crate::runtime::camera::Camera;
use crate::solid::{Surface, TriMesh};
use serde::Serialize;
use std::collections::BTreeMap;

#[derive(Serialize)]
struct Payload {
    components: Vec<Component>,
    meshes: Vec<Mesh>,
    contacts: Vec<Touch>,
    /// Where the station's camera stands, seen from what it looks at.
    camera: Option<[f64; 3]>,
}

#[derive(Serialize)]
struct Component {
    name: String,
    part: String,
    mesh: usize,
    /// Rows of a 3 × 4 matrix: part to assembly, mm.
    pose: Vec<f32>,
    /// How far it moves in the exploded view (mm).
    offset: [f32; 3],
    colour: String,
    material: String,
    /// When it is put in: 0 for the base.
    step: usize,
    /// The highest upper bound of an escape rate over its faults.
    risk: Option<f64>,
}

#[derive(Serialize)]
struct Mesh {
    /// Positions (f32, mm), normals (i8, 127 for 1), triangles (u32), face of each triangle (u32).
    positions: String,
    normals: String,
    triangles: String,
    faces: String,
    /// Per face: its name, its surface, its area.
    names: Vec<[String; 3]>,
}

/// A contact: component and face of both sides, and what there is to say.
#[derive(Serialize)]
struct Touch {
    a: [usize; 2],
    b: [usize; 2],
    kind: &'static str,
    fit: Option<&'static str>,
    area: String,
    /// The gap at MMC and at LMC, and at worst over limits and zones.
    gap: [String; 2],
    play: [String; 2],
}

/// The JSON. No `<` is left in it: nothing can end the script element early.
pub fn payload(assembly: &Assembly, report: &Report) -> String {
    let kit = Kit::new(assembly.design, assembly.solids);
    let payload = Payload {
        components: components(assembly, &kit, report),
        meshes: kit.parts.iter().map(mesh).collect(),
        contacts: assembly.analysis.map_or_else(Vec::new, |a| a.liaison.contacts.iter().map(touch).collect()),
        camera: report.view.map(|v| towards(&v.choice.camera)),
    };
    json::compact(&payload).replace('<', "\\u003c")
}

fn towards(camera: &Camera) -> [f64; 3] {
    camera.axes[2].map(|v| 0.0 - v)
}

fn components(assembly: &Assembly, kit: &Kit, report: &Report) -> Vec<Component> {
    let Assembly { design, solids, analysis, .. } = assembly;
    let poses: Vec<_> = kit.placed.iter().map(|p| p.pose).collect();
    let shifts = analysis.map(|a| insertion::exploded(&a.insertion, solids, &poses)).unwrap_or_default();
    let steps = analysis.map(|a| steps(&a.insertion, design.components.len())).unwrap_or_default();
    let risk = |name: &str| {
        let modes = report.model.iter().flat_map(|m| &m.model.promise.modes).filter(|m| m.component == name);
        modes.map(|m| m.escape.upper_95).reduce(f64::max)
    };
    // What was not cut into solids has nothing to show.
    let component = |(i, placed): (usize, &crate::exchange::Placed)| {
        let part = &design.parts[design.components[i].part];
        Component {
            name: placed.name.clone(),
            part: part.name.clone(),
            mesh: placed.part,
            pose: placed.pose.to_homogeneous().fixed_rows::<3>(0).transpose().iter().map(|v| *v as f32 + 0.0).collect(),
            offset: shifts.get(i).map_or([0.0; 3], |s| [s.x, s.y, s.z].map(|v| v as f32 + 0.0)),
            colour: colour::hex(colour::component(i)),
            material: design.materials[part.material].name.clone(),
            step: steps.get(i).copied().unwrap_or(0),
            risk: risk(&placed.name),
        }
    };
    kit.placed.iter().enumerate().map(component).collect()
}

/// When each component is put in, the reverse of taking apart: 0 for the base and whatever cannot be parted from it.
pub fn steps(insertion: &Insertion, components: usize) -> Vec<usize> {
    let mut steps = vec![0; components];
    let rounds = insertion.rounds.len();
    let mut next = 0;
    for round in (0..=rounds).rev() {
        let own = insertion.rounds.get(round);
        let groups = insertion.groups.iter().filter(|g| g.after == round).map(|g| &g.members);
        for members in own.into_iter().chain(groups) {
            next += 1;
            members.iter().for_each(|c| steps[*c] = next);
        }
    }
    steps
}

fn touch(contact: &Contact) -> Touch {
    Touch {
        a: [contact.a.component, contact.a.face],
        b: [contact.b.component, contact.b.face],
        kind: kind(contact.kind),
        fit: contact.fit.map(fit),
        area: number(contact.area, 2),
        gap: contact.gap_range.map(|g| number(g, 4)),
        play: contact.play.map(|g| number(g, 4)),
    }
}

fn kind(kind: ContactKind) -> &'static str {
    match kind {
        ContactKind::Plane => "flat",
        ContactKind::Cylinder => "cylinder",
        ContactKind::Cone => "cone",
        ContactKind::Sphere => "sphere",
        ContactKind::Torus => "torus",
        ContactKind::Tangent => "tangent",
    }
}

fn fit(fit: Fit) -> &'static str {
    match fit {
        Fit::Clearance => "clearance",
        Fit::Transition => "transition",
        Fit::Interference => "interference",
    }
}

fn mesh(part: &KitPart) -> Mesh {
    let Corners { positions, normals, triangles } = Corners::of(&part.solid.mesh);
    let solid = &part.solid;
    let name = |f: &crate::solid::Face| {
        [f.name.clone(), surface(&solid.surfaces[f.surface]), format!("{} mm²", number(f.area, 2))]
    };
    let words = |words: &mut dyn Iterator<Item = u32>| base64(&words.flat_map(u32::to_le_bytes).collect::<Vec<u8>>());
    Mesh {
        positions: base64(&positions.iter().flatten().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>()),
        normals: base64(&normals.iter().flatten().map(|v| *v as u8).collect::<Vec<u8>>()),
        triangles: words(&mut triangles.iter().copied()),
        faces: words(&mut solid.mesh.faces.iter().copied()),
        names: solid.faces.iter().map(name).collect(),
    }
}

/// What a face lies on, in a few words.
fn surface(surface: &Surface) -> String {
    match surface {
        Surface::Plane { .. } => "plane".into(),
        Surface::Cylinder { radius, .. } => format!("cylinder ⌀ {}", number(2.0 * radius, 4)),
        Surface::Cone { half_angle, .. } => format!("cone {}°", number(2.0 * half_angle.to_degrees(), 2)),
        Surface::Sphere { radius, .. } => format!("sphere ⌀ {}", number(2.0 * radius, 4)),
        Surface::Torus { major, minor, .. } => {
            format!("torus ⌀ {}, tube ⌀ {}", number(2.0 * major, 4), number(2.0 * minor, 4))
        }
    }
}

/// Points of a mesh, each once for every normal it has.
struct Corners {
    positions: Vec<[f32; 3]>,
    normals: Vec<[i8; 3]>,
    triangles: Vec<u32>,
}

impl Corners {
    fn of(mesh: &TriMesh) -> Corners {
        let mut known: BTreeMap<(u32, [i8; 3]), u32> = BTreeMap::new();
        let mut out = Corners { positions: Vec::new(), normals: Vec::new(), triangles: Vec::new() };
        for (vertex, normal) in mesh.triangles.iter().flatten().zip(mesh.normals.iter().flatten()) {
            let normal = [normal.x, normal.y, normal.z].map(|v| (v * 127.0).round() as i8);
            let index = *known.entry((*vertex, normal)).or_insert_with(|| {
                let p = mesh.positions[*vertex as usize];
                out.positions.push([p.x, p.y, p.z].map(|v| v as f32 + 0.0));
                out.normals.push(normal);
                out.positions.len() as u32 - 1
            });
            out.triangles.push(index);
        }
        out
    }
}
