"""Faults of shapes, mesh files and collision geometry."""

import struct

from lxml import etree

from studies.seeded_defects.spoiling import assign, drop, kind, pick, scale


@kind("geometry")
def mesh_missing(r, rng):
    mesh = pick(rng, r.meshes())
    return None if mesh is None else assign(mesh, "filename", "meshes/no_such.obj")


@kind("geometry")
def mesh_other_case(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    folder, _, name = mesh.get("filename").rpartition("/")
    return assign(mesh, "filename", f"{folder}/{name.upper()}")


@kind("geometry")
def mesh_backslash(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    return assign(mesh, "filename", mesh.get("filename").replace("/", "\\"))


@kind("geometry")
def mesh_absolute(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    return assign(mesh, "filename", "/home/someone/ws/src/arm/" + mesh.get("filename"))


@kind("geometry")
def mesh_package_unknown(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    return assign(mesh, "filename", "package://no_such_pkg/" + mesh.get("filename"))


@kind("geometry")
def mesh_path_escapes(r, rng):
    mesh = pick(rng, r.meshes())
    return (
        None
        if mesh is None
        else assign(mesh, "filename", "../" * 12 + "etc/passwd.obj")
    )


@kind("geometry")
def mesh_filename_missing(r, rng):
    return assign(pick(rng, r.meshes()), "filename", None)


@kind("geometry")
def mesh_is_folder(r, rng):
    mesh = pick(rng, r.meshes())
    return None if mesh is None else assign(mesh, "filename", "meshes")


def _mesh_of_bytes(r, rng, data, suffix=None):
    mesh = pick(rng, r.meshes())
    if mesh is not None:
        r.new_mesh(mesh, data, suffix)
    return mesh


@kind("geometry")
def mesh_empty(r, rng):
    return _mesh_of_bytes(r, rng, b"")


@kind("geometry")
def mesh_lfs_pointer(r, rng):
    text = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1234\n"
    return _mesh_of_bytes(r, rng, text)


@kind("geometry")
def mesh_html_page(r, rng):
    return _mesh_of_bytes(r, rng, b"<!DOCTYPE html><html><body>404</body></html>")


@kind("geometry")
def mesh_stl_cut(r, rng):
    triangle = struct.pack("<12fH", *([0.0] * 3), 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    data = b"cut".ljust(80) + struct.pack("<I", 500) + triangle * 20
    return _mesh_of_bytes(r, rng, data, ".stl")


def _changed(r, rng, change):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    vertices, faces = r.obj(mesh)
    r.write_obj(mesh, *change(vertices, faces))
    return mesh


@kind("geometry")
def mesh_nan_vertex(r, rng):
    def change(v, f):
        v[rng.randrange(len(v))][1] = float("nan")
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_index_out_of_range(r, rng):
    def change(v, f):
        f[rng.randrange(len(f))][2] = len(v) + 5
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_no_faces(r, rng):
    return _changed(r, rng, lambda v, f: (v, []))


@kind("geometry")
def mesh_in_millimetres(r, rng):
    return _changed(r, rng, lambda v, f: ([[1e3 * x for x in p] for p in v], f))


def _rescaled(mesh, factor):
    if mesh is not None:
        mesh.set("scale", mesh.get("scale") or "1 1 1")
    return scale(mesh, "scale", factor)


@kind("geometry")
def mesh_scaled_down_twice(r, rng):
    return _rescaled(pick(rng, r.meshes()), 0.001)


@kind("geometry")
def mesh_in_inches(r, rng):
    return _rescaled(pick(rng, r.meshes()), 39.37)


@kind("geometry")
def mesh_scale_zero(r, rng):
    return assign(pick(rng, r.meshes()), "scale", "1 0 1")


@kind("geometry")
def mesh_mirrored(r, rng):
    return assign(pick(rng, r.meshes()), "scale", "1 -1 1")


@kind("geometry")
def mesh_degenerate_faces(r, rng):
    def change(v, f):
        extra = [[t[0], t[1], t[1]] for t in rng.sample(f, min(3, len(f)))]
        return v, f + extra

    return _changed(r, rng, change)


@kind("geometry")
def mesh_faces_twice(r, rng):
    return _changed(r, rng, lambda v, f: (v, f + rng.sample(f, max(1, len(f) // 20))))


@kind("geometry")
def mesh_winding_mixed(r, rng):
    def change(v, f):
        for i in rng.sample(range(len(f)), max(1, len(f) // 10)):
            f[i] = f[i][::-1]
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_inside_out(r, rng):
    return _changed(r, rng, lambda v, f: (v, [t[::-1] for t in f]))


@kind("geometry")
def mesh_open(r, rng):
    def change(v, f):
        for i in sorted(rng.sample(range(len(f)), max(1, len(f) // 20)), reverse=True):
            del f[i]
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_crosses_itself(r, rng):
    def change(v, f):
        size = [max(p[k] for p in v) - min(p[k] for p in v) for k in range(3)]
        moved = [[p[k] + 0.37 * size[k] for k in range(3)] for p in v]
        return v + moved, f + [[i + len(v) for i in t] for t in f]

    return _changed(r, rng, change)


@kind("geometry")
def collision_missing(r, rng):
    links = [k for k in r.links() if k.find("visual") is not None]
    link = pick(rng, [k for k in links if len(k.findall("collision")) == 1])
    return drop(link, "collision")


def _origin_of(collision):
    origin = collision.find("origin")
    if origin is None:
        origin = etree.SubElement(collision, "origin", xyz="0 0 0")
    return origin


@kind("geometry")
def collision_elsewhere(r, rng):
    links = [k for k in r.links() if k.find("visual") is not None]
    found = [c for k in links for c in k.findall("collision")]
    collision = pick(rng, [c for c in found if len(c.getparent()) and _single(c)])
    if collision is None:
        return None
    origin = _origin_of(collision)
    x, y, z = (float(w) for w in origin.get("xyz", "0 0 0").split())
    origin.set("xyz", f"{x + 0.4:.6g} {y:.6g} {z + 0.2:.6g}")
    return collision


def _single(collision):
    return len(collision.getparent().findall("collision")) == 1


@kind("geometry")
def collision_much_too_small(r, rng):
    meshes = [m for m in r.meshes() if _single(m.getparent().getparent())]
    meshes = [
        m
        for m in meshes
        if m.getparent().getparent().getparent().find("visual") is not None
    ]
    return assign(pick(rng, meshes), "scale", "0.1 0.1 0.1")


@kind("geometry")
def shape_size_negative(r, rng):
    shape = pick(rng, [s for t in ("box", "sphere", "cylinder") for s in r.shapes(t)])
    if shape is None:
        return None
    name = "size" if shape.tag == "box" else "radius"
    words = shape.get(name).split()
    return assign(shape, name, " ".join(["-" + words[0], *words[1:]]))


@kind("geometry")
def shape_size_zero(r, rng):
    shape = pick(rng, [s for t in ("sphere", "cylinder") for s in r.shapes(t)])
    return assign(shape, "radius", "0")


@kind("geometry")
def shape_size_missing(r, rng):
    shape = pick(rng, [s for t in ("sphere", "cylinder") for s in r.shapes(t)])
    return assign(shape, "radius", None)


@kind("geometry")
def shape_size_two_numbers(r, rng):
    return assign(pick(rng, r.shapes("box")), "size", "0.1 0.1")
