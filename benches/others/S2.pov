// A white box and a white sphere: tests/references/S2.glb for POV-Ray 3.7.
#include "box.inc"

box {
    <-0.3, -0.6, -0.3>, <0.3, 0.6, 0.3>
    rotate 18 * y
    translate <-0.38, 0.60, -0.35>
    pigment { White }
}

sphere {
    <0.42, 0.35, 0.30>, 0.35
    pigment { White }
}
