//! Recognition of files of the wrong kind by the extension of their names.

use std::path::Path;

/// A kind of file that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wanted {
    /// The surface of a body.
    Obj,
    /// A volume mesh.
    Msh,
}

/// Names of kinds of files, with their extensions. Files with other extensions are read and judged by their
/// contents.
const KINDS: &[(&str, &[&str])] = &[
    ("STL", &["stl"]),
    ("STEP", &["step", "stp", "p21"]),
    ("IGES", &["iges", "igs"]),
    ("PLY", &["ply"]),
    ("OFF", &["off"]),
    ("3MF", &["3mf"]),
    ("AMF", &["amf"]),
    ("glTF", &["gltf", "glb"]),
    ("DXF", &["dxf"]),
    ("DWG", &["dwg"]),
    ("GDSII", &["gds", "gdsii", "gds2", "oas"]),
    ("Gerber", &["gbr", "ger", "gtl", "gbl"]),
    ("SVG", &["svg"]),
    ("BREP", &["brep", "brp"]),
    ("Parasolid", &["x_t", "x_b"]),
    ("ACIS", &["sat", "sab"]),
    ("FreeCAD", &["fcstd"]),
    ("SolidWorks", &["sldprt", "sldasm"]),
    ("Blender", &["blend"]),
    ("VTK", &["vtk", "vtu", "vtp", "pvd"]),
    ("Gmsh geometry", &["geo"]),
    ("Medit", &["mesh", "meshb"]),
    ("UNV", &["unv"]),
    ("MED", &["med"]),
    ("Nastran", &["nas", "bdf"]),
    ("Abaqus", &["inp"]),
    ("Netgen", &["vol"]),
    ("XDMF", &["xdmf", "xmf"]),
    ("OBJ", &["obj"]),
    ("MSH", &["msh"]),
    ("CSV", &["csv"]),
    ("TOML", &["toml"]),
    ("JSON", &["json"]),
    ("PDF", &["pdf"]),
];

impl Wanted {
    /// The kind of a file by its name, if it is not the expected one.
    pub(super) fn other(self, path: &Path) -> Option<&'static str> {
        let end = path.extension()?.to_str()?.to_ascii_lowercase();
        let (kind, _) = KINDS.iter().find(|(_, ends)| ends.contains(&end.as_str()))?;
        let expected = match self {
            Self::Obj => "OBJ",
            Self::Msh => "MSH",
        };
        (*kind != expected).then_some(kind)
    }

    /// Advice on what to do about a file of another kind.
    pub(super) fn cure(self, kind: &str) -> &'static str {
        match (self, kind) {
            (Self::Obj, "MSH") => {
                "name it in [mesh] and its groups by `physical`, or export the surface of the body as OBJ"
            }
            (Self::Obj, _) => "OBJ is: export the surface of the body as OBJ",
            (Self::Msh, "OBJ") => {
                "name it as the `surface` of a body, or mesh the scene with Gmsh and save it as .msh"
            }
            (Self::Msh, _) => ".msh of Gmsh is, version 4.1 or 2.2: export the mesh as that",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_other_kinds_are_known_by_the_end_of_their_names() {
        let other = |wanted: Wanted, name: &str| wanted.other(Path::new(name));
        assert_eq!(other(Wanted::Obj, "a/cube.STL"), Some("STL"));
        assert_eq!(other(Wanted::Obj, "cube.stp"), Some("STEP"));
        assert_eq!(other(Wanted::Obj, "cube.obj"), None);
        assert_eq!(other(Wanted::Obj, "cube"), None);
        assert_eq!(other(Wanted::Obj, "cube.txt"), None);
        assert_eq!(other(Wanted::Msh, "cube.obj"), Some("OBJ"));
        assert_eq!(other(Wanted::Msh, "cube.msh"), None);
    }
}
