// SPDX-License-Identifier: GPL-2.0-or-later
//
// Arrays of the readings of bumpers, fiducial finders and blobfinders, filled from rows.

#ifndef STAGE_PYTHON_FINDER_ROWS_HH
#define STAGE_PYTHON_FINDER_ROWS_HH

#include "models/model_type.hh"
#include "models/readings.hh"
#include "row_crowd.hh"

namespace Stg::python {

/// True if rows have all readings of the type, which is not that of rangers.
bool IsFinderOfRows(const ModelType& type);
/// Fills in where the sensor of that model is in rows of the scene.
void FindInFinders(const rows::Finders& finders, SensorOfRow* sensor);
/// Writes a reading of such a sensor into a row of an array of that shape, as CopyReading() does.
void FillFromFinder(const Reading& reading, const SensorOfRow& sensor, const RowOfCrowd& row,
                    const ReadingShape& space, void* to);

}  // namespace Stg::python

#endif
