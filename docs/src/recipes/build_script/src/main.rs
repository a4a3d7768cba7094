//! Judges photos with the inspector that was built in: one line of JSON each.

use gonogo::runtime::embed::Session;
use std::process::ExitCode;

const MODEL: &str = include_str!(concat!(env!("OUT_DIR"), "/plate.model.ron"));

fn main() -> ExitCode {
    let session = match Session::open(MODEL.as_bytes(), None) {
        Ok(session) => session,
        Err(why) => {
            eprintln!("{why}");
            return ExitCode::FAILURE;
        }
    };
    let [width, height] = session.size();
    println!("ready for photos of {width} x {height} px");
    for name in std::env::args().skip(1) {
        match std::fs::read(&name) {
            Ok(bytes) => println!("{}", session.judge_file(&name, &bytes).json()),
            Err(error) => eprintln!("{name}: {error}"),
        }
    }
    ExitCode::SUCCESS
}
