/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Material properties over temperature: linear between the rows of a table, constant beyond its ends. */
#ifndef DEMPM_GRAIN_TABLE_H
#define DEMPM_GRAIN_TABLE_H

#include <stdbool.h>

#include "../base/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/* `rows` rows of `columns` numbers: a temperature, then one property per column 1, 2... */
typedef struct GrainTable {
  const double *value;
  int rows, columns;
} GrainTable;

/* BASE_ERROR_ARGUMENT unless there is a row and a property, all numbers are finite, temperatures rise from row to row,
 * and properties are >= 0 (> 0 with `positive`). */
BaseStatus grain_table_check(const GrainTable *table, bool positive);
double grain_table_find(const GrainTable *table, int column, double temperature);
/* From temperature 0 to `temperature`: of a capacity (J/(kg K)) the enthalpy, J/kg. */
double grain_table_integral(const GrainTable *table, int column, double temperature);
/* The temperature to which `heat` (J/kg, of either sign) takes what has `temperature` and the capacity of the column,
 * > 0: the integral between both temperatures is `heat` to round-off. */
double grain_table_heat(const GrainTable *table, int column, double temperature, double heat);

#ifdef __cplusplus
}
#endif
#endif
