//! Surfaces remeshed within a tolerance.
