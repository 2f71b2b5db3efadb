/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Sums whose last digit does not depend on the order of the terms, hence neither on LIGGGHTS' order of particles nor on
 * the number of ranks. */
#ifndef LMP_DOUBLE_SUM_H
#define LMP_DOUBLE_SUM_H

namespace LAMMPS_NS {

/* high + low is the sum with about 32 digits: low collects what each addition to high rounds away (Knuth's two-sum).
 * Orders differ in digits that the final rounding to a double drops. */
struct DoubleSum {
  double high = 0.0, low = 0.0;

  void add(double x) {
    const double sum = high + x, part = sum - high;
    low += (high - (sum - part)) + (x - part);
    high = sum;
  }
  void add(const DoubleSum &other) {
    add(other.high);
    low += other.low;
  }
  double value() const { return high + low; }
};

}  // namespace LAMMPS_NS

#endif
