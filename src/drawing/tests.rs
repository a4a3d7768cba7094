//! Pictures of assemblies that are not the pattern wheel.
