// Sample types as GDAL names them.
#pragma once

#include <optional>

#include <gdal_priv.h>

#include "prepare/samples.h"

namespace tellurion::prepare {

constexpr GDALDataType gdal_type(SampleType type) {
  switch (type) {
    case SampleType::u8:
      return GDT_Byte;
    case SampleType::u16:
      return GDT_UInt16;
    case SampleType::i16:
      return GDT_Int16;
    case SampleType::u32:
      return GDT_UInt32;
    case SampleType::i32:
      return GDT_Int32;
    case SampleType::f32:
      return GDT_Float32;
    case SampleType::f64:
      return GDT_Float64;
  }
  return GDT_Unknown;
}

/// Nothing for types that are not prepared: complex numbers, integers of 64 bits.
constexpr std::optional<SampleType> sample_type(GDALDataType type) {
  for (const SampleType one : {SampleType::u8, SampleType::u16, SampleType::i16, SampleType::u32, SampleType::i32, SampleType::f32, SampleType::f64}) {
    if (gdal_type(one) == type) return one;
  }
  return std::nullopt;
}

}  // namespace tellurion::prepare
