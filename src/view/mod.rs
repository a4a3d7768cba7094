//! Stage 5b: what a camera sees of each component and face, and the boxes and masks of the nodes.
