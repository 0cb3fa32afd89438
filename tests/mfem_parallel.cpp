// Does MFEM read the parts of a mesh, and solve the same on them as on the whole?
//
//   mpirun -np N mfem_parallel PREFIX WHOLE.mfem
//
// Part r is PREFIX with six digits. Compile against MFEM 4.6 or later with MPI. Linear elements: Poisson's equation, zero on the boundary, on the
// parts and on the whole, which every process cuts for itself; energies are compared. Quadratic elements: a harmonic polynomial of second degree
// given on the boundary must come back (the patch test). Exit code 0 when both hold.
#include "mfem.hpp"
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>

using namespace mfem;

// Releases before 4.7 know format 1.2, which is 1.3 without names of attributes.
static std::string Text(const std::string &path)
{
   std::ifstream in(path);
   MFEM_VERIFY(in, path << " is not there");
   std::string line, text;
#if MFEM_VERSION < 40700
   bool is_name = false;
   while (std::getline(in, line))
   {
      if (line == "attribute_sets" || line == "bdr_attribute_sets") { is_name = true; }
      if (line == "boundary" || line == "vertices") { is_name = false; }
      if (line == "MFEM mesh v1.3") { line = "MFEM mesh v1.2"; }
      if (!is_name) { text += line + "\n"; }
   }
#else
   while (std::getline(in, line)) { text += line + "\n"; }
#endif
   return text;
}

static double Harmonic(const Vector &p) { return p(0) * p(0) + p(1) * p(2) - p(2) * p(2) + p(0); }

// Energy of the solution with load 1 (order 1), or the greatest error of the harmonic polynomial (order 2).
static double Solve(ParMesh &mesh, int order)
{
   H1_FECollection elements(order, 3);
   ParFiniteElementSpace space(&mesh, &elements);
   // What bounds the domain; faces between regions are boundary elements too, and are inside. Only after an exchange are shared faces known as such.
   mesh.ExchangeFaceNbrData();
   Array<int> fixed(space.GetVSize()), dofs, list;
   fixed = 0;
   for (int e = 0; e < mesh.GetNBE(); e++)
   {
#if MFEM_VERSION < 40700
      int face = mesh.GetBdrElementEdgeIndex(e);
#else
      int face = mesh.GetBdrElementFaceIndex(e);
#endif
      if (!mesh.GetFaceInformation(face).IsBoundary()) { continue; }
      space.GetBdrElementDofs(e, dofs);
      for (int d : dofs) { fixed[d < 0 ? -1 - d : d] = 1; }
   }
   space.Synchronize(fixed);
   Array<int> true_fixed(space.GetTrueVSize());
   for (int d = 0; d < fixed.Size(); d++)
   {
      int t = space.GetLocalTDofNumber(d);
      if (t >= 0) { true_fixed[t] = fixed[d]; }
   }
   for (int t = 0; t < true_fixed.Size(); t++) { if (true_fixed[t]) { list.Append(t); } }
   ConstantCoefficient one(1.0);
   FunctionCoefficient exact(Harmonic);
   ParGridFunction u(&space);
   u = 0.0;
   if (order == 2) { u.ProjectCoefficient(exact); }
   ParLinearForm load(&space);
   // The polynomial is harmonic: of x x, y z, - z z and x the Laplacians are 2, 0, -2 and 0.
   if (order == 1) { load.AddDomainIntegrator(new DomainLFIntegrator(one)); }
   load.Assemble();
   ParBilinearForm form(&space);
   form.AddDomainIntegrator(new DiffusionIntegrator(one));
   form.Assemble();
   if (order == 2)
   {
      // Inside nothing is known ahead.
      Vector t;
      u.GetTrueDofs(t);
      for (int i = 0; i < t.Size(); i++) { if (!true_fixed[i]) { t(i) = 0.0; } }
      u.SetFromTrueDofs(t);
   }
   OperatorPtr A;
   Vector B, X;
   form.FormLinearSystem(list, u, load, A, X, B);
   HypreBoomerAMG amg;
   amg.SetPrintLevel(0);
   CGSolver cg(MPI_COMM_WORLD);
   cg.SetRelTol(1e-14);
   cg.SetMaxIter(4000);
   cg.SetPreconditioner(amg);
   cg.SetOperator(*A);
   cg.Mult(B, X);
   form.RecoverFEMSolution(X, load, u);
   if (order == 2) { return u.ComputeMaxError(exact); }
   return load(u);
}

int main(int argc, char *argv[])
{
   Mpi::Init(argc, argv);
   Hypre::Init();
   std::ostringstream name;
   name << argv[1] << std::setw(6) << std::setfill('0') << Mpi::WorldRank();
   std::istringstream part_text(Text(name.str())), whole_text(Text(argv[2]));
   // Tetrahedra stay as they are: nothing is refined.
   ParMesh parts(MPI_COMM_WORLD, part_text, false);
   Mesh serial(whole_text, 1, 0);
   ParMesh whole(MPI_COMM_WORLD, serial);
   const long long n = parts.GetGlobalNE(), n_whole = whole.GetGlobalNE();
   const double on_parts = Solve(parts, 1), on_whole = Solve(whole, 1), error = Solve(parts, 2);
   const double apart = std::abs(on_parts - on_whole) / on_whole;
   if (Mpi::Root())
   {
      std::cout << "MFEM " << GetVersionStr() << " on " << Mpi::WorldSize() << " processes: " << n << " tetrahedra, energy " << on_parts
                << ", differs by " << apart << " from the whole's; quadratics come back within " << error << std::endl;
   }
   return n == n_whole && apart < 1e-10 && error < 1e-9 ? 0 : 1;
}
