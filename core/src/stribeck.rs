//! The Stribeck curves.
