//! Stage 6: a scene and a camera become linear images, one per light group.
