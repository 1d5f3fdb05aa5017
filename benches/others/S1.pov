// Mirror and glass: tests/references/S1.glb for POV-Ray 3.7.
#include "box.inc"

sphere {
    <-0.45, 0.40, -0.40>, 0.40
    pigment { rgb 0 }
    finish { diffuse 0 reflection { 1 } }
    photons { target reflection on refraction off }
}

sphere {
    <0.45, 0.40, 0.35>, 0.40
    pigment { rgbt <1, 1, 1, 1> }
    finish { diffuse 0 reflection { 0, 1 fresnel on } conserve_energy }
    interior { ior 1.5 }
    photons { target reflection on refraction on }
}
