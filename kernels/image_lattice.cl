// Which cells of a lattice of images interpolation serves well: those at whose middles, where it is
// worst, it gives F and U to within `allowed`. Work-items are scalar, whatever the lane width.

#include "image_lattice.clh"

// cells: numbers of `count` cells; middle_field, middle_versors: the kind's F and U at their
// middles, in the order of `cells`. trusted: by cell.
kernel void trust_cells(global const int* cells, int count, global const real* middle_field,
                        global const real* middle_versors, global const real* grid,
                        global const int* places, global const real* field,
                        global const real* versors, real allowed, global uchar* trusted) {
  int number = (int)get_global_id(0);
  if (number >= count) return;
  image_lattice lattice = {grid, places, field, versors, trusted};
  predicted_image image = interpolated_image(lattice, cells[number], (real3)((real)0.5));
  real4 off = image.u - vload4((size_t)number, middle_versors);
  real error = sqrt(dot(off, off));
#ifdef QJ_MODULUS_IS_CHEAP
  (void)middle_field;  // F itself is at hand
#else
  error += fabs(image.f - middle_field[number]);
#endif
  trusted[cells[number]] = error <= allowed;
}
