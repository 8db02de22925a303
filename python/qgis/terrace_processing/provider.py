# SPDX-License-Identifier: Apache-2.0
"""Four Processing algorithms, each of which calls one function of the module `terrace`."""

from qgis.core import (QgsApplication, QgsCoordinateReferenceSystem, QgsFeature, QgsFeatureSink, QgsField, QgsFields,
                       QgsGeometry, QgsPointXY, QgsProcessing, QgsProcessingAlgorithm, QgsProcessingException,
                       QgsProcessingOutputNumber, QgsProcessingParameterCrs, QgsProcessingParameterEnum,
                       QgsProcessingParameterExtent, QgsProcessingParameterFeatureSink, QgsProcessingParameterFile,
                       QgsProcessingParameterFileDestination, QgsProcessingParameterFolderDestination,
                       QgsProcessingParameterMultipleLayers, QgsProcessingParameterNumber, QgsProcessingParameterString,
                       QgsProcessingProvider, QgsWkbTypes)
from qgis.PyQt.QtCore import QVariant

import terrace

VERTICAL = ['recorded', 'ellipsoidal', 'orthometric', 'ignore']
REAL = QgsProcessingParameterNumber.Double


class Cancelled(Exception):
    pass


class Algorithm(QgsProcessingAlgorithm):
    """Base class of the algorithms. Subclasses define `title`, `help`, parameters() and work()."""

    title = help = ''

    def name(self):
        return self.title.lower().replace(' ', '_')

    def displayName(self):
        return self.title

    def shortHelpString(self):
        return self.help

    def createInstance(self):
        return type(self)()

    def initAlgorithm(self, configuration=None):
        for parameter in self.parameters():
            self.addParameter(parameter)

    def processAlgorithm(self, parameters, context, feedback):
        def progress(what, count, fraction, ended):
            if feedback.isCanceled():
                raise Cancelled
            feedback.setProgress(100 * fraction)

        try:
            return self.work(parameters, context, progress)
        except Cancelled:
            return {}
        except (terrace.Error, ValueError, OSError, MemoryError) as error:
            raise QgsProcessingException(str(error)) from error

    def store(self, parameters, context):
        return terrace.open(self.parameterAsFile(parameters, 'STORE', context))


def store_parameter():
    return QgsProcessingParameterFile('STORE', 'Store', QgsProcessingParameterFile.Folder)


class Build(Algorithm):
    title = 'Build'
    help = 'Streams rasters or point clouds in one pass and constant memory into a store, the folder that the other algorithms read.'

    def parameters(self):
        return [QgsProcessingParameterMultipleLayers('INPUT', 'Rasters or point clouds (LAS, LAZ, text)',
                                                     QgsProcessing.TypeFile),
                QgsProcessingParameterCrs('CRS', 'Reference system (overrides the one in the files)', optional=True),
                QgsProcessingParameterString('WHERE', 'Condition on attributes, such as classification == 2', optional=True),
                QgsProcessingParameterFolderDestination('OUTPUT', 'Store')]

    def initAlgorithm(self, configuration=None):
        super().initAlgorithm(configuration)
        self.addOutput(QgsProcessingOutputNumber('POINTS', 'Points'))

    def work(self, parameters, context, progress):
        crs = self.parameterAsCrs(parameters, 'CRS', context)
        folder = self.parameterAsString(parameters, 'OUTPUT', context)
        store = terrace.build(self.parameterAsFileList(parameters, 'INPUT', context), folder, replace=True,
                              crs=crs.toWkt(QgsCoordinateReferenceSystem.WKT_PREFERRED) if crs.isValid() else None,
                              where=self.parameterAsString(parameters, 'WHERE', context) or None, progress=progress)
        return {'OUTPUT': folder, 'POINTS': len(store)}


class BoundedMesh(Algorithm):
    title = 'Bounded mesh'
    help = 'Makes a mesh with few triangles and a bounded error, verified at every sample. QGIS shows it as a mesh layer.'

    def parameters(self):
        return [store_parameter(), QgsProcessingParameterNumber('MAX_ERROR', 'Largest error in metres', REAL, 1.0, minValue=0),
                QgsProcessingParameterFileDestination('OUTPUT', 'Mesh', 'PLY (*.ply);;OBJ (*.obj);;glTF (*.glb)')]

    def work(self, parameters, context, progress):
        path = self.parameterAsFileOutput(parameters, 'OUTPUT', context)
        self.store(parameters, context).bounded_mesh(self.parameterAsDouble(parameters, 'MAX_ERROR', context), path=path,
                                                     replace=True, progress=progress)
        return {'OUTPUT': path}


class Contours(Algorithm):
    title = 'Contours'
    help = 'Draws contour lines of the surface through all samples, in the reference system of the store.'

    def parameters(self):
        return [store_parameter(), QgsProcessingParameterNumber('INTERVAL', 'Height between contours', REAL, 10.0, minValue=1e-9),
                QgsProcessingParameterExtent('EXTENT', 'Region', optional=True),
                QgsProcessingParameterFeatureSink('OUTPUT', 'Contours', QgsProcessing.TypeVectorLine)]

    def work(self, parameters, context, progress):
        store = self.store(parameters, context)
        crs = QgsCoordinateReferenceSystem.fromWkt(store.info['crs']['wkt'])
        box = self.parameterAsExtent(parameters, 'EXTENT', context, crs)
        region = None if box.isEmpty() else (box.xMinimum(), box.yMinimum(), box.xMaximum(), box.yMaximum())
        lines = store.contours(self.parameterAsDouble(parameters, 'INTERVAL', context), region=region, lonlat=False,
                               progress=progress)
        fields = QgsFields()
        fields.append(QgsField('elev', QVariant.Double))
        sink, name = self.parameterAsSink(parameters, 'OUTPUT', context, fields, QgsWkbTypes.LineString, crs)
        for line in lines['features']:
            feature = QgsFeature(fields)
            feature.setAttributes([float(line['properties']['elev'])])
            feature.setGeometry(QgsGeometry.fromPolylineXY([QgsPointXY(*xy) for xy in line['geometry']['coordinates']]))
            sink.addFeature(feature, QgsFeatureSink.FastInsert)
        return {'OUTPUT': name}


class Tiles(Algorithm):
    title = 'Tiles'
    help = 'Writes quantized-mesh tiles for web globes such as Cesium, from zoom 0 to a given zoom or the one that shows every sample.'

    def parameters(self):
        return [store_parameter(), QgsProcessingParameterNumber('ZOOM', 'Deepest zoom', minValue=0, maxValue=24, optional=True),
                QgsProcessingParameterEnum('VERTICAL', 'Vertical reference of the heights', VERTICAL, defaultValue=0),
                QgsProcessingParameterFolderDestination('OUTPUT', 'Tiles')]

    def work(self, parameters, context, progress):
        folder = self.parameterAsString(parameters, 'OUTPUT', context)
        zooms = None
        if parameters.get('ZOOM') is not None:
            zooms = 0, self.parameterAsInt(parameters, 'ZOOM', context)
        self.store(parameters, context).tiles(folder, zooms, replace=True, progress=progress,
                                              vertical=VERTICAL[self.parameterAsEnum(parameters, 'VERTICAL', context)])
        return {'OUTPUT': folder}


class Provider(QgsProcessingProvider):
    def id(self):
        return 'terrace'

    def name(self):
        return 'terrace'

    def loadAlgorithms(self):
        for algorithm in (Build, BoundedMesh, Contours, Tiles):
            self.addAlgorithm(algorithm())


class Plugin:
    def initProcessing(self):
        self.provider = Provider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    initGui = initProcessing

    def unload(self):
        QgsApplication.processingRegistry().removeProvider(self.provider)
