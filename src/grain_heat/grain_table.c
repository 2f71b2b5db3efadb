/* SPDX-License-Identifier: GPL-2.0-or-later */
#include "grain_table.h"

#include <math.h>

static double at(const GrainTable *table, int row, int column) {
  return table->value[(size_t)row * (size_t)table->columns + (size_t)column];
}

BaseStatus grain_table_check(const GrainTable *table, bool positive) {
  if (table->rows < 1 || table->columns < 2)
    return base_error(BASE_ERROR_ARGUMENT, "the table has %d rows and %d columns, allowed are 1 and 2 or more",
                      table->rows, table->columns);
  for (int row = 0; row < table->rows; row++) {
    const double temperature = at(table, row, 0);
    if (!isfinite(temperature) || (row > 0 && temperature <= at(table, row - 1, 0)))
      return base_error(BASE_ERROR_ARGUMENT, "the temperature %g in row %d of the table: temperatures must rise",
                        temperature, row + 1);
    for (int column = 1; column < table->columns; column++) {
      const double value = at(table, row, column);
      if (!isfinite(value) || value < 0.0 || (positive && value == 0.0))
        return base_error(BASE_ERROR_ARGUMENT, "%g in row %d, column %d of the table, allowed is a number %s 0", value,
                          row + 1, column + 1, positive ? ">" : ">=");
    }
  }
  return BASE_OK;
}

/* Rows at temperatures below `temperature`, or also at it. */
static int count_rows(const GrainTable *table, double temperature, bool at_it) {
  int n = 0;
  while (n < table->rows && (at(table, n, 0) < temperature || (at_it && at(table, n, 0) == temperature))) n++;
  return n;
}

/* Rise per kelvin between rows n - 1 and n; 0 beyond the ends. */
static double find_slope(const GrainTable *table, int column, int n) {
  if (n == 0 || n == table->rows) return 0.0;
  return (at(table, n, column) - at(table, n - 1, column)) / (at(table, n, 0) - at(table, n - 1, 0));
}

double grain_table_find(const GrainTable *table, int column, double temperature) {
  const int n = count_rows(table, temperature, true);
  if (n == 0) return at(table, 0, column);
  return at(table, n - 1, column) + find_slope(table, column, n) * (temperature - at(table, n - 1, 0));
}

double grain_table_integral(const GrainTable *table, int column, double temperature) {
  const int n = count_rows(table, temperature, false);
  double sum = at(table, 0, column) * (n == 0 ? temperature : at(table, 0, 0));
  for (int row = 1; row < n; row++)
    sum += 0.5 * (at(table, row, column) + at(table, row - 1, column)) * (at(table, row, 0) - at(table, row - 1, 0));
  if (n == 0) return sum;
  const double last = at(table, n - 1, column), here = grain_table_find(table, column, temperature);
  return sum + 0.5 * (last + here) * (temperature - at(table, n - 1, 0));
}

double grain_table_heat(const GrainTable *table, int column, double temperature, double heat) {
  const bool up = heat > 0.0;
  for (;;) {
    const int n = count_rows(table, temperature, up), end = up ? n : n - 1;
    const double capacity = grain_table_find(table, column, temperature);
    if (end >= 0 && end < table->rows) {
      const double to_end = 0.5 * (capacity + at(table, end, column)) * (at(table, end, 0) - temperature);
      if (fabs(heat) > fabs(to_end)) {
        heat -= to_end, temperature = at(table, end, 0);
        continue;
      }
    }
    /* capacity x + slope x^2 / 2 = heat */
    const double slope = find_slope(table, column, n);
    return temperature + 2.0 * heat / (capacity + sqrt(fmax(capacity * capacity + 2.0 * slope * heat, 0.0)));
  }
}
