use super::*;
use crate::scene::build::{Placed, camera};
use crate::train::shots;
use crate::{assembly, design};
use std::f64::consts::FRAC_PI_2;

/// The plan of a spec of one station, seen from above.
fn planned(text: &str) -> (Design, Camera, Plan) {
    let loaded = design::load("small.gng", &|_| Ok(text.to_string()), &[]);
    let design = loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
    let station = &design.stations[0];
    let nominal = shots::nominal(&design, station).unwrap();
    let (found, _) = assembly::analyse(&design, &nominal.solids);
    let modes = assembly::fault::all(&design, &found.liaison, &found.insertion, &nominal.solids);
    let camera = camera(&station.camera, Placed { distance: 400.0, elevation: 1.4, azimuth: -FRAC_PI_2 });
    let plan = plan(&design, &camera, &nominal, &found.liaison, &modes);
    (design, camera, plan)
}

/// A lid of 24 mm on a spacer, seen from above. What is changed at the lid's middle belongs to the lid where the spacer shows
/// beside it; where it is hidden, the lid's coming down is all that tells of it.
#[test]
fn a_node_is_where_its_own_component_shows_and_not_what_moves_with_it() {
    for (spacer, shows) in [(40.0, true), (16.0, false)] {
        let text = format!(
            "gonogo 1\nunits mm deg\ntolerances exact\nmaterial paint {{\n kind = matt\n}}\n\
             part base {{\n material = paint\n add slab = box(x = 60, y = 60, z = 4)\n}}\n\
             part spacer {{\n material = paint\n add disc = cylinder(d = {spacer}, h = 6)\n}}\n\
             part lid {{\n material = paint\n add disc = cylinder(d = 24, h = 5)\n}}\n\
             assembly stack {{\n root base\n place spacer on base {{\n  z = 4\n }}\n place lid on spacer {{\n  z = 6\n }}\n}}\n\
             station bench {{\n camera fixed {{\n image = 160 x 120 px\n focal = 16\n pitch = 0.03\n distance = 400\n elevation = 80\n}}\n\
             light room = room()\n}}\ninspect stack {{\n watch spacer\n watch lid\n}}\n"
        );
        let (design, camera, plan) = planned(&text);
        let node = plan.nodes.iter().find(|n| design.components[n.component].name == "spacer").unwrap();
        let middle = camera.reduced(plan.base).project([0.0, 0.0, 15.0]).unwrap().map(|v| v as usize);
        let at = |mask: &Mask| mask.bits[middle[1] * mask.width + middle[0]];
        assert!(at(&node.reach), "{spacer}: the lid comes down");
        assert_eq!(at(&node.changed), !shows, "{spacer}");
    }
}

/// Pins on a plate: the plate's node is where neither they nor their faults show, and only where it is watched.
#[test]
fn the_roots_node_is_what_shows_of_it_beside_the_others() {
    let plan_of = |inspect: &str| {
        let text = format!(
            "gonogo 1\nunits mm deg\ntolerances exact\nmaterial paint {{\n kind = matt\n}}\n\
             part base {{\n material = paint\n add slab = box(x = 60, y = 60, z = 4)\n}}\n\
             part pin {{\n material = paint\n add rod = cylinder(d = 8, h = 6)\n}}\n\
             assembly board {{\n root base\n place pin on base {{\n  z = 4\n }}\n}}\n\
             station bench {{\n camera fixed {{\n image = 160 x 120 px\n focal = 16\n pitch = 0.03\n distance = 400\n elevation = 80\n}}\n\
             light room = room()\n}}\n{inspect}"
        );
        planned(&text).2
    };
    let plan = plan_of("");
    let [pin, base] = &plan.nodes[..] else { panic!("{} nodes", plan.nodes.len()) };
    assert_eq!((pin.component, base.component), (1, ROOT));
    assert!(base.modes.is_empty() && base.disturbs.is_empty() && base.disturbed.is_empty());
    let shown = plan.good.mask(ROOT);
    assert!(base.changed.count() > shown.count() / 2 && base.changed.count() < shown.count());
    let own = |i: usize| shown.bits[i] && !pin.reach.bits[i];
    assert!((0..shown.bits.len()).all(|i| !base.changed.bits[i] || own(i)));
    for inspect in ["inspect board {\n watch pin\n}\n", "inspect board {\n ignore base\n}\n"] {
        assert_eq!(plan_of(inspect).nodes.len(), 1, "{inspect}");
    }
    assert_eq!(plan_of("inspect board {\n watch base\n watch pin\n}\n").nodes.len(), 2);
}
