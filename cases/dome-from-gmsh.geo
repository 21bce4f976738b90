// A dome on a rubber slab over a square electrode, in mm. Writes dome-from-gmsh.msh: gmsh -3 dome-from-gmsh.geo
SetFactory("OpenCASCADE");
Sphere(1) = {0, 0, 0, 10};                     // the air around, up to where open space begins
Box(2) = {-1.5, -1.5, -0.5, 3, 3, 0.5};        // the rubber
Sphere(3) = {0, 0, 0, 0.8, 0, Pi/2, 2*Pi};     // the dome, standing on it
Rectangle(100) = {-1, -1, -0.5, 2, 2};         // the electrode under it, a sheet
BooleanFragments{ Volume{1}; Delete; }{ Volume{2, 3}; Surface{100}; Delete; }

rubber() = Volume In BoundingBox {-1.6, -1.6, -0.6, 1.6, 1.6, 0.1};
dome() = Volume In BoundingBox {-0.9, -0.9, -0.1, 0.9, 0.9, 0.9};
sheet() = Surface In BoundingBox {-1.1, -1.1, -0.6, 1.1, 1.1, -0.4};
air() = Volume{:};
air() -= {rubber(), dome()};
Physical Volume("rubber") = {rubber()};
Physical Volume("dome") = {dome()};
Physical Volume("air") = {air()};
Physical Surface("sheet") = {sheet()};

MeshSize{ PointsOf{ Volume{air()}; } } = 5;
MeshSize{ PointsOf{ Volume{rubber()}; } } = 0.7;
MeshSize{ PointsOf{ Volume{dome()}; } } = 0.22;
Mesh.MshFileVersion = 4.1;
Mesh.Binary = 1;
