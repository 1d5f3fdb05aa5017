//! The source and the documents: layers, layouts, scenes of the repository, what the documents
//! name.

mod circles;
mod documents;
mod layers;
mod layouts;
mod library;
mod readme;
mod scenes;
mod shader_names;
