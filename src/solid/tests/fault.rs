//! E0410, the fault of the kernel itself: no spec is known that leads to it, so its checks are shown what they are there
//! for: the boundary of a good part with something wrong done to it.

use super::*;
use crate::diag::Sources;

const SPEC: &str = "\
gonogo 1
tolerances exact
material steel { metal = steel }
part plate {
    material = steel
    add slab = box(x = 20, y = 10, z = 4)
    cut bore = cylinder(d = 4, h = through)
}
assembly it { root plate }
station bench { light room = room() }
";

type Tamper = fn(&mut arrange::Arrangement);

/// What the kernel says of the plate once its boundary has been tampered with.
fn faults(tamper: Tamper) -> (Sources, Vec<Diagnostic>) {
    let loaded = crate::design::load("plate.gng", &|_| Ok(SPEC.into()), &[]);
    let design = loaded.design.expect("a good spec");
    let mut tree = csg::Tree::build(&design.parts[0], &design.nominal()).expect("a good part");
    let mut arrangement = arrange::arrange(&tree).expect("a good part");
    tamper(&mut arrangement);
    let outcome = closed(&mut tree, &arrangement, &Quality::default());
    (loaded.sources, outcome.expect_err("no solid with such a boundary"))
}

#[test]
fn every_check_of_the_boundary_says_what_it_found() {
    let cases: [(Tamper, &str); 6] = [
        (|a| a.arcs[0].uses.truncate(1), "an edge has not two faces but 1"),
        (|a| drop(a.arcs.remove(0)), "a loop of edges breaks off"),
        (|a| a.arcs.retain(|arc| arc.ends.is_none()), "a hole lies in no face"),
        (
            |a| a.arcs.retain(|arc| arc.ends.is_some() || a.curves[arc.curve].at(0.0).z < 1.0),
            "loops of edges do not bound a face",
        ),
        (inside_out, "it encloses no volume"),
        (move_corner, "`slab.bottom` cannot be filled with triangles"),
    ];
    for (tamper, what) in cases {
        let (_, faults) = faults(tamper);
        let [fault] = &faults[..] else { panic!("{faults:?}") };
        assert_eq!(fault.code, "E0410");
        assert_eq!(fault.message, format!("the boundary of `plate` cannot be closed: {what}"));
    }
}

fn inside_out(arrangement: &mut arrange::Arrangement) {
    for part in arrangement.arcs.iter_mut().flat_map(|arc| &mut arc.uses) {
        (part.outward, part.forward) = (!part.outward, !part.forward);
    }
}

/// Draws the outline of the plate's underside through its bore.
fn move_corner(arrangement: &mut arrange::Arrangement) {
    let is_there = |p: &&mut Point3<f64>| p.x > 1.0 && p.y < -1.0 && p.z < 1.0;
    arrangement.corners.iter_mut().filter(is_there).for_each(|p| *p = Point3::origin());
}

#[cfg(feature = "cli")]
#[test]
fn the_report_says_whose_fault_it_is() {
    let (sources, faults) = faults(|a| drop(a.arcs.remove(0)));
    let text: String =
        crate::cli::report::human(&sources, &faults, false).lines().map(|l| format!("{}\n", l.trim_end())).collect();
    assert_eq!(
        text,
        "\
error[E0410]: the boundary of `plate` cannot be closed: a loop of edges breaks off
 --> plate.gng:4:6
  |
4 | part plate {
  |      ^^^^^ no solid was made of it
  |
  = note: a fault of the compiler, not of the spec; features that almost touch are the usual cause

1 error
"
    );
}
