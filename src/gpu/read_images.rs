//! Tables as storage images, for software.
//!
//! Lavapipe reads storage buffers in a loop over words and lanes, in which each word waits until
//! the last one is stored in its vector. Of a texture it reads the texels of all lanes in one go.
//! It first finds the level of detail of each lane, which takes longer than the rest; storage
//! images have no levels.

use wgpu::naga::{
    AddressSpace, Expression, ImageClass, Module, ResourceBinding, Span, StorageAccess, StorageFormat, Type, TypeInner,
};

use super::shaders::{Binding, BindingKind, Shader};

/// Format of texels of so many words.
pub(super) fn format_of(words: u32) -> wgpu::TextureFormat {
    if words == 1 { wgpu::TextureFormat::R32Uint } else { wgpu::TextureFormat::Rgba32Uint }
}

/// Has a kernel read its tables as images.
pub(super) fn read_images(module: &mut Module, shader: &Shader) {
    let words = |binding: &ResourceBinding| {
        let is_it = |b: &&Binding| (b.group, b.index) == (binding.group, binding.binding);
        match shader.bindings.iter().find(is_it).map(|b| b.kind) {
            Some(BindingKind::Table { words, .. }) => Some(words),
            _ => None,
        }
    };
    for (_, variable) in module.global_variables.iter_mut().filter(|(_, v)| v.space == AddressSpace::Handle) {
        let TypeInner::Image { dim, arrayed, .. } = module.types[variable.ty].inner else { continue };
        let Some(words) = variable.binding.as_ref().and_then(words) else { continue };
        let format = if words == 1 { StorageFormat::R32Uint } else { StorageFormat::Rgba32Uint };
        let class = ImageClass::Storage { format, access: StorageAccess::LOAD };
        let inner = TypeInner::Image { dim, arrayed, class };
        variable.ty = module.types.insert(Type { name: None, inner }, Span::UNDEFINED);
    }
    let functions = module.functions.iter_mut().map(|(_, function)| function);
    for function in functions.chain(module.entry_points.iter_mut().map(|entry| &mut entry.function)) {
        for (_, expression) in function.expressions.iter_mut() {
            if let Expression::ImageLoad { level, .. } = expression {
                *level = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use wgpu::naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;
    use crate::gpu::{shaders::SHADERS, specialize::specialized};

    #[test]
    fn kernels_that_read_images_are_valid() {
        for shader in SHADERS.iter().filter(|shader| shader.tables() > 0) {
            let mut module =
                specialized(shader.wgsl, &[("MAP_IN_TABLES", 1.0)]).expect("a text that build.rs composed");
            let images = |module: &Module| {
                let is_storage =
                    |inner: &TypeInner| matches!(inner, TypeInner::Image { class: ImageClass::Storage { .. }, .. });
                module.global_variables.iter().filter(|(_, v)| is_storage(&module.types[v.ty].inner)).count() as u32
            };
            assert_eq!(images(&module), 0, "{}: control", shader.stem);
            read_images(&mut module, shader);
            assert!(images(&module) > 0, "{}", shader.stem);
            Validator::new(ValidationFlags::all(), Capabilities::all())
                .validate(&module)
                .unwrap_or_else(|error| panic!("{}: {error:?}", shader.stem));
        }
    }
}
