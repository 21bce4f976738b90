//! `cargo +nightly fuzz run mesher`: any bytes as a scene of bodies, which is meshed.
//!
//! Most coordinates lie on a coarse lattice, so that bodies touch, coincide and cross; some are of another
//! order of magnitude.

#![no_main]

use elastocap_geometry::meshing::tets::{Sizing, determinant, mesh};
use elastocap_geometry::scene::{Body, Box3, Scene, Wall};
use elastocap_geometry::shapes::Shape;

/// Numbers out of bytes; zeros when these are used up.
struct Numbers<'a>(std::slice::Iter<'a, u8>);

impl Numbers<'_> {
    fn byte(&mut self) -> u8 {
        self.0.next().copied().unwrap_or(0)
    }

    /// A multiple of a quarter up to 32 in size, or rarely a tiny or a huge number.
    fn real(&mut self) -> f64 {
        let lattice = 0.25 * f64::from(self.byte() as i8);
        match self.byte() {
            0 => lattice * 1e-12,
            1 => lattice * 1e12,
            2 => lattice + 1e-9,
            3 => lattice * (1.0 + f64::EPSILON),
            _ => lattice,
        }
    }

    fn point(&mut self) -> [f64; 3] {
        [self.real(), self.real(), self.real()]
    }

    fn shape(&mut self) -> Shape {
        let axis = usize::from(self.byte() % 3);
        match self.byte() % 5 {
            0 => {
                let (a, b) = (self.point(), self.point());
                Shape::Box(Box3 {
                    min: [0, 1, 2].map(|k| a[k].min(b[k])),
                    max: [0, 1, 2].map(|k| a[k].max(b[k])),
                })
            }
            1 => Shape::Sphere { center: self.point(), radius: self.real().abs().max(1e-9) },
            3 => Shape::Capsule { from: self.point(), to: self.point(), radius: self.real().abs().max(1e-9) },
            2 => Shape::Cylinder {
                axis,
                base: self.point(),
                radius: self.real().abs().max(1e-9),
                height: self.real().abs().max(1e-9),
            },
            _ => {
                let from = self.real();
                let corners = 3 + usize::from(self.byte() % 6);
                let outline = (0..corners).map(|_| [self.real(), self.real()]).collect();
                Shape::Extrusion { axis, from, to: from + self.real().abs(), outline, arcs: Vec::new() }
            }
        }
    }
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut numbers = Numbers(bytes.iter());
    let walls = [Wall::Open, Wall::Grounded, Wall::Insulated][usize::from(numbers.byte() % 3)];
    let domain = match walls {
        Wall::Open => Box3::SPACE,
        Wall::Grounded | Wall::Insulated => Box3 { min: [-100.0; 3], max: [100.0; 3] },
    };
    let count = 1 + usize::from(numbers.byte() % 4);
    let bodies = (0..count)
        .map(|k| match numbers.byte() % 3 {
            0 => Body::dielectric(format!("d{k}"), numbers.shape(), 2.0),
            _ => Body::conductor(format!("c{k}"), numbers.shape()),
        })
        .collect();
    let scene = Scene { bodies, background_permittivity: 1.0, domain, walls: [[walls; 2]; 3] };
    if let Ok(meshed) = mesh(&scene, &Sizing { max_points: 3_000, ..Sizing::default() }) {
        let mesh = meshed.mesh;
        for tet in &mesh.tets {
            let [a, b, c, d] = tet.map(|p| mesh.points[p as usize]);
            assert!(determinant(a, b, c, d) > 0.0, "a tetrahedron is turned inside out");
        }
    }
});
