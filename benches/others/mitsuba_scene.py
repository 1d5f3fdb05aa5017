"""Renders tests/references/S1.glb or S2.glb with Mitsuba 3, rewritten in its own terms.

mitsuba_scene.py SCENE VARIANT INTEGRATOR SPP SIZE OUT.exr"""

import sys

import mitsuba as mi

scene, variant, integrator, spp, size, out = sys.argv[1:]
mi.set_variant(variant)
T = mi.ScalarTransform4f

WHITE = (0.725, 0.71, 0.68)


def diffuse(colour):
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": colour}}


def wall(to_world, colour):
    return {"type": "rectangle", "to_world": to_world, "bsdf": {"type": "twosided", "inner": diffuse(colour)}}


def sphere(centre, radius, bsdf):
    return {"type": "sphere", "center": centre, "radius": radius, "bsdf": bsdf}


world = {
    "type": "scene",
    "integrator": {"type": integrator, "max_depth": -1},
    # Mitsuba's cameras look along +z with +x to the left, as `look_at` turns them.
    "camera": {
        "type": "perspective",
        "fov": 31.5,
        "to_world": T().look_at(origin=[0, 1, 4.5], target=[0, 1, 0], up=[0, 1, 0]),
        "film": {
            "type": "hdrfilm",
            "width": int(size),
            "height": int(size),
            "pixel_format": "rgb",
            "component_format": "float32",
            "filter": {"type": "box"},
        },
        "sampler": {"type": "independent", "sample_count": int(spp)},
    },
    "lamp": {"type": "point", "position": [0, 1.7, 0], "intensity": {"type": "rgb", "value": 5.0}},
    "floor": wall(T().rotate([1, 0, 0], -90), WHITE),
    "ceiling": wall(T().translate([0, 2, 0]).rotate([1, 0, 0], 90), WHITE),
    "back": wall(T().translate([0, 1, -1]), WHITE),
    "left": wall(T().translate([-1, 1, 0]).rotate([0, 1, 0], 90), (0.63, 0.065, 0.05)),
    "right": wall(T().translate([1, 1, 0]).rotate([0, 1, 0], -90), (0.14, 0.45, 0.091)),
}
if scene == "S1":
    world["mirror"] = sphere([-0.45, 0.40, -0.40], 0.40, {"type": "conductor", "material": "none"})
    world["glass"] = sphere([0.45, 0.40, 0.35], 0.40, {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
else:
    turned = T().translate([-0.38, 0.60, -0.35]).rotate([0, 1, 0], 18).scale([0.3, 0.6, 0.3])
    world["box"] = {"type": "cube", "to_world": turned, "bsdf": diffuse(WHITE)}
    world["ball"] = sphere([0.42, 0.35, 0.30], 0.35, diffuse(WHITE))
mi.Bitmap(mi.render(mi.load_dict(world))).write(out)
