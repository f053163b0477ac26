//! URDF import.
