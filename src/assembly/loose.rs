//! The faults of a part that rests on others and that no fit holds: up at one side, beside its place, upside down; and of one
//! that fits guide over a short length: up at one side.
//!
//! In: such a component among the others, and the zone in which it may lie. Out: its error modes, at most one of each sort.
//! Which of the two it is is not asked here.

use super::fault::{FaultKind, Motion};
use super::room::{Among, Room};
use super::{flip, shift, tilt};
use crate::design::model::{Design, Expr};
use nalgebra::Vector3;

/// The modes by which the component is off by `least` mm or more, and upside down.
pub(crate) fn loose(design: &Design, of: &Among, least: f64) -> Vec<(FaultKind, Motion)> {
    let room = Room::new(of, shift::FAR);
    if !room.seated {
        return Vec::new();
    }
    let tilt = tilt::tilt(&room, least, None).map(|t| (FaultKind::NotSeated, Motion::Tilt(t)));
    let shift = place_zone(design, of).and_then(|zone| shift::shift(&room, &zone, least));
    let shift = shift.map(|s| (FaultKind::Misplaced, Motion::Shift(s)));
    let flip = flip::flip(&room).map(|f| (FaultKind::Misplaced, Motion::Flip(f)));
    tilt.into_iter().chain(shift).chain(flip).collect()
}

/// The mode by which a component that fits guide over `length` mm is up at one side by `least` mm or more.
pub(crate) fn askew(of: &Among, least: f64, length: f64) -> Vec<(FaultKind, Motion)> {
    let room = Room::new(of, 0.0);
    let tilt = room.seated.then(|| tilt::tilt(&room, least, Some(length))).flatten();
    tilt.map(|t| (FaultKind::NotSeated, Motion::Tilt(t))).into_iter().collect()
}

/// Half the tolerance of a component's place along a direction (mm); `None` if some place is free.
fn place_zone(design: &Design, of: &Among) -> Option<impl Fn(&Vector3<f64>) -> f64> {
    let placed = &design.components[of.component];
    let half = |axis: &Expr| match axis {
        Expr::Dim(id) => design.dims[id.0 as usize].range.half_width(),
        _ => 0.0,
    };
    // The axes of a zone are those of the frame on which the component is placed.
    let frame = of.poses[of.component].rotation * placed.pose.eval(&design.nominal()).rotation.inverse();
    let zone = Vector3::from_iterator(placed.pose.t.iter().map(half));
    let along = move |direction: &Vector3<f64>| frame.inverse_transform_vector(direction).abs().dot(&zone);
    (!placed.free[..3].contains(&true)).then_some(along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::fault::{ErrorMode, apply, modes};
    use crate::assembly::shift::Shift;
    use crate::assembly::turn::Turn;
    use crate::assembly::{analyse, place::place, sample};
    use crate::design::model::{Expr, Extent, Op, Shape};
    use sample::{Cut, Shop};

    fn cuboid(x: f64, y: f64, z: f64) -> Shape {
        Shape::Box { x: Expr::Const(x), y: Expr::Const(y), z: Extent::Length(Expr::Const(z)) }
    }

    fn modes_of(a: &mut sample::Assembly, component: usize) -> Vec<ErrorMode> {
        let (found, _) = analyse(&a.design, &a.solids);
        a.design.inspect.watch.retain(|w| w.component == component);
        modes(&a.design, &found.liaison, &found.insertion, &a.solids)
    }

    fn shift_of(modes: &[ErrorMode]) -> Option<&Shift> {
        modes.iter().find_map(|m| match &m.motion {
            Motion::Shift(shift) => Some(shift),
            _ => None,
        })
    }

    fn count(modes: &[ErrorMode], sort: impl Fn(&Motion) -> bool) -> usize {
        modes.iter().filter(|m| sort(&m.motion)).count()
    }

    /// A slotted bar on a plate, a stud through its slot with a nut on the bar, and perhaps a block 6 by 20 mm beside it; zone
    /// ±0.4 mm along x.
    fn bar(stop: Option<[f64; 2]>) -> (sample::Assembly, usize) {
        let mut shop = Shop::default();
        let plate = shop.plate("plate", [5.0, 0.0], [100.0, 0.0], &[Cut::hole("hole", 0.0, 0.0, 8.0, 0.0)]);
        let bar = vec![
            ("bar", Op::Add, cuboid(50.0, 20.0, 6.0), [0.0; 3]),
            ("slot", Op::Cut, cuboid(22.0, 8.6, 8.0), [0.0, 0.0, -1.0]),
        ];
        let bar = shop.made_of("bar", bar);
        let stud = shop.pin("stud", &[("bar", 8.0, 8.0, [0.0, 0.0], 25.0)]);
        let nut = shop.plate("nut", [5.0, 0.0], [14.0, 0.0], &[Cut::hole("hole", 0.0, 0.0, 8.0, 0.0)]);
        let block = shop.made_of("stop", vec![("bar", Op::Add, cuboid(6.0, 20.0, 9.0), [0.0; 3])]);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        let component = shop.place("bar", bar, [0.0, 0.0, 5.0], 0.0, 0.01);
        shop.vary(component, 0, 0.4);
        shop.place("stud", stud, [0.0; 3], 0.0, 0.0);
        shop.place("nut", nut, [0.0, 0.0, 11.0], 0.0, 0.0);
        if let Some([x, y]) = stop {
            shop.place("stop", block, [x, y, 5.0], 0.0, 0.0);
        }
        (shop.finish(), component)
    }

    fn turn_of(modes: &[ErrorMode]) -> Option<&Turn> {
        modes.iter().find_map(|m| match &m.motion {
            Motion::Turn(turn) => Some(turn),
            _ => None,
        })
    }

    /// A block 2.5 mm off one long side of the bar is met at 8 deg to the one side, and never to the other.
    #[test]
    fn a_clamped_bar_can_be_turned_under_its_nut_up_to_what_stops_it() {
        for (stop, ends) in [(None, [-40.0, -5.0, 5.0, 40.0]), (Some([15.0, 22.5]), [-40.0, -5.0, 5.0, 5.0])] {
            let (mut a, bar) = bar(stop);
            let found = modes_of(&mut a, bar);
            let turn = turn_of(&found).expect("the slot lets it turn");
            let degrees: Vec<f64> = turn.ranges.iter().flatten().map(|r| r.to_degrees().round()).collect();
            assert_eq!(degrees, ends);
            let mode = found.iter().find(|m| matches!(m.motion, Motion::Turn(_))).expect("just found");
            let faulted = apply(mode, [0.2, 0.5, 0.5], &a.solids, &place(&a.design, &a.design.nominal()));
            assert!(faulted.text.ends_with(" deg"), "it lies under the nut, not on it: {}", faulted.text);
            assert!((faulted.pose.expect("there").translation.z - 5.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_slotted_bar_can_slide_along_its_slot_from_three_zones_on() {
        let (mut a, bar) = bar(None);
        let found = modes_of(&mut a, bar);
        let shift = shift_of(&found).expect("7 mm of room along x");
        let ways: Vec<[f64; 3]> = shift.ways.iter().map(|w| w.direction.map(|d| d.round())).collect();
        assert_eq!(ways, [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], "the slot holds it along y: {shift:?}");
        for way in &shift.ways {
            assert!((way.from - 1.2).abs() < 1e-9 && way.to > 3.9, "{way:?}");
        }
        let poses = place(&a.design, &a.design.nominal());
        let mode = found.iter().find(|m| matches!(m.motion, Motion::Shift(_))).expect("just found");
        let faulted = apply(mode, [0.0, 0.9, 0.0], &a.solids, &poses);
        assert_eq!(faulted.text, "shifted 1.2 mm");
        assert!((faulted.pose.expect("there").translation.x + 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_block_beside_it_ends_the_way() {
        let (mut a, bar) = bar(Some([30.5, 0.0]));
        let found = modes_of(&mut a, bar);
        let ends = |sign: f64| {
            let ways = &shift_of(&found).expect("both ways").ways;
            ways.iter().find(|w| w.direction[0] * sign > 0.9).map(|w| w.to).expect("a way")
        };
        assert!((1.9..2.7).contains(&ends(1.0)) && ends(-1.0) > 3.9, "{} {}", ends(1.0), ends(-1.0));
    }

    /// A washer with play of 0.2 mm round its stud, and one with 2 mm.
    #[test]
    fn only_play_beyond_the_smallest_fault_lets_a_washer_lie_aside() {
        let washer = |hole: f64| {
            let mut shop = Shop::default();
            let plate = shop.plate("plate", [5.0, 0.0], [60.0, 0.0], &[Cut::hole("hole", 0.0, 0.0, 6.0, 0.0)]);
            let washer = shop.plate("washer", [4.0, 0.0], [16.0, 0.0], &[Cut::hole("hole", 0.0, 0.0, hole, 0.0)]);
            let stud = shop.pin("stud", &[("bar", 6.0, 6.0, [0.0, 0.0], 25.0)]);
            shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
            let component = shop.place("washer", washer, [0.0, 0.0, 5.0], 0.0, 0.0);
            shop.components[component].free[5] = true;
            shop.place("stud", stud, [0.0; 3], 0.0, 0.0);
            modes_of(&mut shop.finish(), component)
        };
        assert_eq!(shift_of(&washer(6.4)), None);
        let loose = washer(10.0);
        let shift = shift_of(&loose).expect("2 mm of play");
        assert_eq!(shift.ways.len(), 8);
        assert!(shift.ways.iter().all(|w| w.from == 0.5 && (1.6..2.4).contains(&w.to)), "{shift:?}");
    }

    /// A bolt in its hole, and a disc with a spigot in a bore: nothing moves sideways, leans or is turned over.
    #[test]
    fn a_part_held_by_a_fit_is_not_loose() {
        let mut shop = Shop::default();
        let plate = shop.plate("plate", [8.0, 0.0], [60.0, 0.0], &[Cut::hole("hole", 0.0, 0.0, 6.0, 0.0)]);
        let bolt = shop.pin("bolt", &[("shank", 5.9, 5.9, [0.0, 0.0], 6.0), ("head", 24.0, 24.0, [0.0, 0.0], 2.0)]);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        let component = shop.place("bolt", bolt, [0.0, 0.0, 2.0], 0.0, 0.0);
        let found = modes_of(&mut shop.finish(), component);
        assert_eq!(
            count(&found, |m| matches!(m, Motion::Shift(_) | Motion::Tilt(_) | Motion::Flip(_))),
            0,
            "{found:?}"
        );
    }

    /// A disc on a stud of a base, guided over 3 mm: 40 mm across it jams askew, 8 mm across it does not.
    #[test]
    fn a_wide_part_guided_over_a_short_length_can_be_up_at_one_side() {
        let cylinder = |d: f64, h: f64| Shape::Cylinder { d: Expr::Const(d), h: Extent::Length(Expr::Const(h)) };
        let tilts = |across: f64, high: f64| {
            let mut shop = Shop::default();
            let base = vec![
                ("slab", Op::Add, cuboid(80.0, 80.0, 5.0), [0.0; 3]),
                ("stud", Op::Add, cylinder(4.0, 3.0), [0.0, 0.0, 5.0]),
            ];
            let disc = vec![
                ("body", Op::Add, cylinder(across, high), [0.0; 3]),
                ("hole", Op::Cut, cylinder(4.05, high + 2.0), [0.0, 0.0, -1.0]),
            ];
            let (base, disc) = (shop.made_of("base", base), shop.made_of("disc", disc));
            shop.place("base", base, [0.0; 3], 0.0, 0.0);
            let component = shop.place("disc", disc, [0.0, 0.0, 5.0], 0.0, 0.0);
            count(&modes_of(&mut shop.finish(), component), |m| matches!(m, Motion::Tilt(_)))
        };
        assert_eq!((tilts(40.0, 4.0), tilts(8.0, 4.0)), (1, 0));
    }

    /// A low lid on a plate; with a bar above it that leaves it 0.05 mm, or without.
    fn lid(held: bool) -> (sample::Assembly, Vec<ErrorMode>) {
        let mut shop = Shop::default();
        let plate = shop.plate("plate", [5.0, 0.0], [80.0, 0.0], &[]);
        let lid = vec![
            ("wall", Op::Add, cuboid(40.0, 30.0, 6.0), [0.0; 3]),
            ("inside", Op::Cut, cuboid(34.0, 24.0, 4.5), [0.0, 0.0, -0.5]),
        ];
        let lid = shop.made_of("lid", lid);
        let yoke = vec![
            ("yoke", Op::Add, cuboid(60.0, 10.0, 12.0), [0.0; 3]),
            ("inside", Op::Cut, cuboid(50.0, 12.0, 7.05), [0.0, 0.0, -1.0]),
        ];
        let yoke = shop.made_of("yoke", yoke);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        let component = shop.place("lid", lid, [0.0, 0.0, 5.0], 0.0, 0.01);
        if held {
            shop.place("yoke", yoke, [0.0, 0.0, 5.0], 0.0, 0.0);
        }
        let mut a = shop.finish();
        let modes = modes_of(&mut a, component);
        (a, modes)
    }

    #[test]
    fn a_lid_can_stand_on_something_at_one_side_unless_it_is_held_down() {
        let (a, modes) = lid(false);
        let mode = modes.iter().find(|m| matches!(m.motion, Motion::Tilt(_))).expect("nothing holds it down");
        assert_eq!(mode.kind, FaultKind::NotSeated);
        let poses = place(&a.design, &a.design.nominal());
        for way in [0.05, 0.3, 0.6, 0.99] {
            let faulted = apply(mode, [1.0, way, 0.0], &a.solids, &poses);
            assert_eq!(faulted.text, "tilted, one side 2.5 mm up");
            let pose = faulted.pose.expect("there");
            let heights = a.solids[1].mesh.positions.iter().map(|p| (pose * p).z - 5.0);
            let lowest = heights.fold(f64::INFINITY, f64::min);
            assert!(lowest.abs() < 0.2, "the other rim stays on the plate: {lowest}");
            let tilt = (pose.rotation * Vector3::z()).angle(&Vector3::z());
            assert!((2.5 / 50.0..2.5 / 29.0).contains(&tilt.sin()), "{tilt}");
        }
        let (_, modes) = lid(true);
        assert_eq!(count(&modes, |m| matches!(m, Motion::Tilt(_))), 0);
    }

    #[test]
    fn a_lid_can_be_upside_down_and_a_plain_block_looks_the_same() {
        let (a, modes) = lid(false);
        let mode = modes.iter().find(|m| matches!(m.motion, Motion::Flip(_))).expect("it lies on its top as well");
        let faulted = apply(mode, [0.5; 3], &a.solids, &place(&a.design, &a.design.nominal()));
        assert_eq!((mode.kind, faulted.text.as_str()), (FaultKind::Misplaced, "upside down"));
        let pose = faulted.pose.expect("there");
        assert!(((pose.rotation * Vector3::z()).z + 1.0).abs() < 1e-9);
        let heights: Vec<f64> = a.solids[1].mesh.positions.iter().map(|p| (pose * p).z).collect();
        let [low, high] = [heights.iter().copied().fold(9.0, f64::min), heights.iter().copied().fold(0.0, f64::max)];
        assert!((low - 5.0).abs() < 0.05 && (high - 11.0).abs() < 0.05, "{low} {high}");
        let (mut a, bar) = bar(None);
        assert_eq!(count(&modes_of(&mut a, bar), |m| matches!(m, Motion::Flip(_))), 0);
    }
}
