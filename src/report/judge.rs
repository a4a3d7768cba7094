//! Judging photos in the page: the runtime as a WebAssembly module with model and calibration, and where photos are dropped.
//!
//! In: the module, the texts of model and calibration. Out: a section, and blocks of data that `judge.js` reads. The page still
//! asks for nothing: its policy lets it compile the module, and no more.

use super::html::{base64, count, escaped, number};
use super::module::Module;
use super::strip::{scale, strip};
use super::{Report, Trained};
use crate::runtime::model::Node;

/// What a page needs to judge.
#[derive(Clone, Copy)]
pub struct Judge<'a> {
    pub module: Module<'a>,
    /// Texts of the files.
    pub model: &'a str,
    pub calibration: Option<&'a str>,
}

/// Glue and page in one script, so that nothing is imported.
pub const SCRIPT: &str = concat!(include_str!("../../include/gonogo.mjs"), include_str!("judge.js"));

pub fn section(report: &Report) -> Option<String> {
    let (judge, trained) = report.judge.zip(report.model)?;
    let Trained { model, .. } = trained;
    let size = |bytes: usize| match bytes as f64 / 1e6 {
        small if small < 0.1 => format!("{} kB", number(1e3 * small, 0)),
        large => format!("{} MB", number(large, 1)),
    };
    let mut carried = vec![
        format!("the runtime ({})", size(judge.module.bytes().len())),
        format!("the model ({})", size(judge.model.len())),
    ];
    carried.extend(judge.calibration.map(|text| format!("its calibration ({})", size(text.len()))));
    let [width, height] = model.station.camera.size;
    let uncalibrated = match judge.calibration {
        Some(_) => "",
        None => {
            " <span class=\"doubt\">Without a calibration, camera and lamps are taken to be as the spec says.</span>"
        }
    };
    Some(format!(
        "<p>Photos are judged here by the runtime of the line, in this page: no photo leaves it. The page carries {}.{uncalibrated}</p>\n\
         <div class=\"drop\" id=\"judge-drop\"><label>Photos of station {}, {width} × {height} px \
         <input type=\"file\" id=\"judge-files\" multiple accept=\"image/png,image/tiff,image/bmp,image/jpeg\"></label> \
         <span>or drop them anywhere on the page.</span></div>\n\
         <p id=\"judge-status\" role=\"status\"></p>\n<div id=\"judge-photos\"></div>\n\
         <template id=\"judge-scores\"><details open><summary>Scores of all {}</summary><table class=\"strips\"><tbody>{}</tbody></table></details>\
         </template>\n",
        carried.join(", "),
        escaped(&model.station.name),
        count(model.nodes.len(), "node"),
        model.nodes.iter().map(|node| row(node, report)).collect::<String>()
    ))
}

/// A node's held-out scores, to which the page adds that of a photo.
fn row(node: &Node, report: &Report) -> String {
    let component = report.assembly.and_then(|a| a.design.components.iter().position(|c| c.name == node.name));
    let component = component.map(|i| format!(" data-component=\"{i}\"")).unwrap_or_default();
    let [low, high] = scale(node).map_or_else(Default::default, |ends| ends.map(|v| v.to_string()));
    let name = escaped(&node.name);
    format!(
        "<tr{component} data-low=\"{low}\" data-high=\"{high}\"><th scope=\"row\">{name}</th><td>{}</td><td class=\"num\"></td></tr>\n",
        strip(node, &[])
    )
}

/// The blocks of data: bytes as base64, which is no markup whatever they are.
pub fn payload(judge: &Judge) -> String {
    let block = |id: &str, bytes: &[u8]| {
        format!("<script type=\"application/octet-stream\" id=\"judge-{id}\">{}</script>\n", base64(bytes))
    };
    let calibration = judge.calibration.map(|text| block("calibration", text.as_bytes()));
    block("module", judge.module.bytes()) + &block("model", judge.model.as_bytes()) + &calibration.unwrap_or_default()
}
