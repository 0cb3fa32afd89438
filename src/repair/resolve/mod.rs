//! Crossing triangles divided where they cross.
