//! The source and the documents: layers, layouts, scenes of the repository, names in the documents.

mod circles;
mod documents;
mod layers;
mod layouts;
mod library;
mod readme;
mod scenes;
mod shader_names;
