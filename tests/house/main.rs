//! The source and the documents: layers, layouts, scenes of the repository, what the documents name.

mod circles;
mod layers;
mod layouts;
mod readme;
mod scenes;
mod shader_names;
