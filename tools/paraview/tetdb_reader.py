"""A reader of tetdb stores for ParaView: Tools > Manage Plugins > Load New, or `pvpython` with `LoadPlugin`.

A store is a folder; open the file `catalog.redb` in it. Only the sub-domains that are chosen are read. With several ranks each reads its
share of them. Needs the Python package `tetdb` where ParaView's Python finds it (PYTHONPATH).
"""

import os

import numpy as np
import tetdb
from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkDataArraySelection, vtkIdTypeArray, vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkUnstructuredGrid
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline


def id_array(values):
    """An array of VTK's own with these numbers, made without a second copy of 64 bits."""
    array = vtkIdTypeArray()
    array.SetNumberOfValues(len(values))
    vtk_to_numpy(array)[:] = values
    return array


@smproxy.reader(name="TetdbStore", label="Tetdb Store", extensions="redb tetdb", file_description="tetdb stores")
class TetdbStore(VTKPythonAlgorithmBase):
    """The tetrahedra of a store, with cell data `region`, `subdomain` and `quality`."""

    def __init__(self):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")
        self._path = None
        self._subdomains = vtkDataArraySelection()
        self._subdomains.AddObserver("ModifiedEvent", lambda *_: self.Modified())

    @smproperty.stringvector(name="FileName")
    @smdomain.filelist()
    @smhint.filechooser(extensions="redb tetdb", file_description="tetdb stores")
    def SetFileName(self, name):
        """The store's folder, or `catalog.redb` in it."""
        path = os.path.dirname(name) if name and name.endswith("catalog.redb") else name
        if path != self._path:
            self._path = path
            self._subdomains.RemoveAllArrays()
            self.Modified()

    @smproperty.dataarrayselection(name="Subdomains")
    def GetSubdomains(self):
        """The sub-domains to read."""
        return self._subdomains

    def RequestInformation(self, request, inputs, outputs):
        """Lists the sub-domains, and that each rank may ask for a part."""
        if self._path:
            with tetdb.open(self._path) as store:
                for part in store.subdomains:
                    name = str(part.rank)
                    if not self._subdomains.ArrayExists(name):
                        self._subdomains.AddArray(name)
        outputs.GetInformationObject(0).Set(vtkAlgorithm.CAN_HANDLE_PIECE_REQUEST(), 1)
        return 1

    def RequestData(self, request, inputs, outputs):
        """Reads this rank's share of the chosen sub-domains."""
        information = outputs.GetInformationObject(0)
        output = vtkUnstructuredGrid.GetData(outputs)
        piece = information.Get(Pipeline.UPDATE_PIECE_NUMBER()) or 0
        n_pieces = max(information.Get(Pipeline.UPDATE_NUMBER_OF_PIECES()) or 1, 1)
        if not self._path:
            return 1
        with tetdb.open(self._path) as store:
            chosen = [p.rank for p in store.subdomains if self._subdomains.ArrayIsEnabled(str(p.rank))]
            mine = chosen[piece::n_pieces]
            if not mine:
                return 1
            mesh = store.merged(mine)
            quality = np.concatenate([store.subdomain(rank).quality for rank in mine])
        points = vtkPoints()
        points.SetData(numpy_to_vtk(mesh.points, deep=True))
        cells = vtkCellArray()
        cells.SetData(id_array(np.arange(0, 4 * len(mesh.tets) + 1, 4)), id_array(mesh.tets.reshape(-1)))
        output.SetPoints(points)
        output.SetCells(VTK_TETRA, cells)
        for name, values in [("region", mesh.regions), ("subdomain", mesh.subdomains), ("quality", quality)]:
            array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
            array.SetName(name)
            output.GetCellData().AddArray(array)
        return 1
