//! Pictures of assemblies that are not the pattern wheel.

use super::liaison;
use super::tree::{self, Source};
use super::view;
use crate::assembly::error_tree::error_tree;
use crate::assembly::sample::{Assembly, Cut, Shop, pattern_wheel};
use crate::assembly::{Analysis, analyse};

/// A plate with a ring of holes, a second plate with the same holes on pins of one part, and a part that touches nothing.
fn pinned(pins: usize) -> Assembly {
    let mut shop = Shop::default();
    let angles: Vec<f64> = (0..pins).map(|k| 360.0 * k as f64 / pins as f64).collect();
    let holes = Cut::holes("hole", 18.0, &angles, 3.0, 0.01);
    let base = shop.plate("base", [5.0, 0.0], [50.0, 0.0], &holes);
    let pin = shop.pin("pin", &[("body", 3.0, 3.0, [-0.01, -0.004], 8.0)]);
    shop.place("base", base, [0.0; 3], 0.0, 0.0);
    for (k, a) in angles.iter().enumerate() {
        let (sin, cos) = a.to_radians().sin_cos();
        shop.place(&format!("pin<{k}> & \"co\""), pin, [18.0 * cos, 18.0 * sin, 2.0], 0.0, 0.0);
    }
    let spare = shop.plate("spare", [1.0, 0.0], [5.0, 0.0], &[]);
    shop.place("spare", spare, [0.0, 0.0, 60.0], 0.0, 0.0);
    shop.finish()
}

fn analysis(a: &Assembly) -> Analysis {
    analyse(&a.design, &a.solids).0
}

#[test]
fn names_are_escaped_and_what_touches_nothing_is_drawn() {
    let a = pinned(3);
    let analysis = analysis(&a);
    let text = liaison::svg(&a.design, &a.solids, &analysis);
    assert!(text.contains(">pin&lt;0&gt; &amp; &quot;co&quot;</text>"), "{text}");
    assert!(text.contains(">spare</text>"), "{text}");
    assert!(liaison::dot(&a.design, &a.solids, &analysis).contains(r#"label="pin<0> & \"co\"""#));
}

#[test]
fn every_part_is_named_in_both_views() {
    let a = pinned(5);
    let analysis = analysis(&a);
    let views = [
        view::assembled(&a.design, &a.solids),
        view::exploded(&a.design, &a.solids, &analysis.liaison, &analysis.insertion),
    ];
    for text in views {
        assert!((0..5).all(|k| text.contains(&format!(">pin&lt;{k}&gt; &amp; &quot;co&quot;</text>"))), "{text}");
    }
}

#[test]
fn wide_trees_are_cut_and_say_so() {
    let a = pinned(3);
    let analysis = analysis(&a);
    let source = Source { design: &a.design, solids: &a.solids, liaison: &analysis.liaison };
    let mut tree = error_tree(&analysis.liaison, 1, Some(1));
    let leaf = tree.nodes[1].clone();
    tree.nodes.resize(201, leaf);
    assert!(tree::svg(&source, &tree).contains(">51 more nodes on deeper levels are not drawn<"));
    assert_eq!(tree::dot(&source, &tree).matches(" -> ").count(), 200);
}

/// Twelve of them cannot be had for less: three pins, each with two contacts to each of two wheels.
#[test]
fn the_pattern_wheel_has_few_crossings() {
    let a = pattern_wheel();
    let crossings = liaison::crossings(&a.design, &a.solids, &analysis(&a));
    assert!(crossings <= 18, "{crossings}");
}
