//! glTF reader.
