//! Gmsh MSH 4.1 reader.
