"""Step I: discretisation of a film, curved meshes graded towards edges and corners."""
