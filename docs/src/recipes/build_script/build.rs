fn main() -> Result<(), gonogo::build::Failed> {
    gonogo::build::spec("specs/plate.gng").compile()?;
    Ok(())
}
