#pragma once

#include <meniscus/io/number_array.h>

#include <optional>
#include <string>
#include <string_view>

namespace meniscus::io {

/// What the head of a VTK XML file says about all its arrays.
struct VtkXmlEncoding {
  std::endian order = std::endian::little;
  NumberType header = NumberType::UInt32;
  bool compressed = false;
  std::string_view appended;  ///< after the '_' of AppendedData
  bool appended_base64 = false;
  std::uint64_t memory_limit = 0;
  std::string path;
};

/// A <DataArray> as the file has it.
struct VtkXmlArray {
  std::string name;
  NumberType type = NumberType::Float32;
  std::size_t components = 1;
  std::string_view format;   ///< "ascii", "binary" or "appended"
  std::string_view content;  ///< between the tags
  std::size_t offset = 0;    ///< into the appended data
};

std::optional<NumberType> vtk_xml_type(std::string_view name);
std::string_view vtk_xml_name(NumberType type);

/// The numbers of an array. Throws IoError for what is not there, ResourceLimit for compressed data that swell beyond the
/// limit.
NumberArray decode(const VtkXmlArray& array, const VtkXmlEncoding& encoding);

}  // namespace meniscus::io
