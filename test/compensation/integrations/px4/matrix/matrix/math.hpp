// Of PX4's matrix library what an effectiveness matrix needs.
#pragma once

namespace matrix {

template <typename Type, int Rows, int Columns>
class Matrix {
 public:
  Type& operator()(int row, int column) { return data_[row][column]; }
  Type operator()(int row, int column) const { return data_[row][column]; }

 private:
  Type data_[Rows][Columns]{};
};

template <typename Type, int Rows>
class Vector {
 public:
  Type& operator()(int row) { return data_[row]; }
  Type operator()(int row) const { return data_[row]; }

 private:
  Type data_[Rows]{};
};

}  // namespace matrix
