#include <meniscus/scene/schema.h>

namespace meniscus::scene {

std::string_view scene_schema() {
  return R"schema({
 "$schema": "http://json-schema.org/draft-07/schema#",
 "title": "meniscus scene",
 "type": "object",
 "properties": {
  "$schema": {
   "type": "string"
  },
  "format": {
   "const": "meniscus.scene"
  },
  "version": {
   "const": 1
  },
  "units": {
   "type": "string"
  },
  "fps": {
   "type": "number",
   "exclusiveMinimum": 0
  },
  "range": {
   "type": "array",
   "minItems": 2,
   "maxItems": 2,
   "items": {
    "type": "integer"
   },
   "description": "first and last frame"
  },
  "params": {
   "type": "object",
   "additionalProperties": {
    "type": "object",
    "properties": {
     "value": {
      "type": "number"
     },
     "min": {
      "type": "number"
     },
     "max": {
      "type": "number"
     },
     "unit": {
      "type": "string"
     },
     "extras": {}
    },
    "required": [
     "value"
    ],
    "additionalProperties": false
   }
  },
  "surface": {
   "$ref": "#/definitions/surface"
  },
  "extras": {}
 },
 "required": [
  "format",
  "version",
  "surface"
 ],
 "additionalProperties": false,
 "definitions": {
  "point": {
   "type": "array",
   "minItems": 3,
   "maxItems": 3,
   "items": {
    "type": "number"
   }
  },
  "number": {
   "description": "a literal, a shared parameter, a curve (t in seconds) or a formula in t",
   "oneOf": [
    {
     "type": "number"
    },
    {
     "type": "object",
     "properties": {
      "param": {
       "type": "string"
      },
      "extras": {}
     },
     "required": [
      "param"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "properties": {
      "t": {
       "type": "array",
       "minItems": 1,
       "items": {
        "type": "number"
       }
      },
      "v": {
       "type": "array",
       "minItems": 1,
       "items": {
        "type": "number"
       }
      },
      "interp": {
       "enum": [
        "step",
        "linear",
        "cubic"
       ]
      },
      "extras": {}
     },
     "required": [
      "t",
      "v"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "properties": {
      "expr": {
       "type": "string"
      },
      "extras": {}
     },
     "required": [
      "expr"
     ],
     "additionalProperties": false
    }
   ]
  },
  "vector": {
   "type": "array",
   "minItems": 3,
   "maxItems": 3,
   "items": {
    "$ref": "#/definitions/number"
   }
  },
  "surface": {
   "oneOf": [
    {
     "type": "object",
     "description": "bias - sum w exp(-d^2/radius^2), or with the compact kernel bias - sum w (1 - d^2/radius^2)^3; bias and threshold are the same",
     "properties": {
      "type": {
       "const": "blobs"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "kernel": {
       "enum": [
        "gaussian",
        "compact"
       ],
       "description": "default compact"
      },
      "bias": {
       "$ref": "#/definitions/number"
      },
      "threshold": {
       "$ref": "#/definitions/number"
      },
      "items": {
       "type": "array",
       "items": {
        "type": "object",
        "properties": {
         "center": {
          "$ref": "#/definitions/vector"
         },
         "radius": {
          "$ref": "#/definitions/number"
         },
         "weight": {
          "$ref": "#/definitions/number"
         },
         "extras": {}
        },
        "required": [
         "center",
         "radius"
        ],
        "additionalProperties": false
       }
      }
     },
     "required": [
      "type",
      "items"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "the same about segments a b",
     "properties": {
      "type": {
       "const": "segments"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "kernel": {
       "enum": [
        "gaussian",
        "compact"
       ],
       "description": "default compact"
      },
      "bias": {
       "$ref": "#/definitions/number"
      },
      "threshold": {
       "$ref": "#/definitions/number"
      },
      "items": {
       "type": "array",
       "items": {
        "type": "object",
        "properties": {
         "a": {
          "$ref": "#/definitions/vector"
         },
         "b": {
          "$ref": "#/definitions/vector"
         },
         "radius": {
          "$ref": "#/definitions/number"
         },
         "weight": {
          "$ref": "#/definitions/number"
         },
         "extras": {}
        },
        "required": [
         "a",
         "b",
         "radius"
        ],
        "additionalProperties": false
       }
      }
     },
     "required": [
      "type",
      "items"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "signed distance",
     "properties": {
      "type": {
       "const": "sphere"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "center": {
       "$ref": "#/definitions/vector"
      },
      "radius": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "center",
      "radius"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "axis-aligned; size is the full edge lengths",
     "properties": {
      "type": {
       "const": "box"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "center": {
       "$ref": "#/definitions/vector"
      },
      "size": {
       "$ref": "#/definitions/vector"
      }
     },
     "required": [
      "type",
      "center",
      "size"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "axis defaults to y",
     "properties": {
      "type": {
       "const": "torus"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "center": {
       "$ref": "#/definitions/vector"
      },
      "axis": {
       "$ref": "#/definitions/vector"
      },
      "major": {
       "$ref": "#/definitions/number"
      },
      "minor": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "center",
      "major",
      "minor"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "signed distance",
     "properties": {
      "type": {
       "const": "capsule"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "a": {
       "$ref": "#/definitions/vector"
      },
      "b": {
       "$ref": "#/definitions/vector"
      },
      "radius": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "a",
      "b",
      "radius"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "the half-space behind point; normal points out",
     "properties": {
      "type": {
       "const": "plane"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "point": {
       "$ref": "#/definitions/vector"
      },
      "normal": {
       "$ref": "#/definitions/vector"
      }
     },
     "required": [
      "type",
      "point",
      "normal"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "axis-aligned",
     "properties": {
      "type": {
       "const": "ellipsoid"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "center": {
       "$ref": "#/definitions/vector"
      },
      "radii": {
       "$ref": "#/definitions/vector"
      }
     },
     "required": [
      "type",
      "center",
      "radii"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "a formula in x, y, z, t and the scene's parameters, negative inside",
     "properties": {
      "type": {
       "const": "expression"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "f": {
       "type": "string"
      },
      "bounds": {
       "type": "array",
       "minItems": 2,
       "maxItems": 2,
       "items": {
        "$ref": "#/definitions/point"
       }
      }
     },
     "required": [
      "type",
      "f"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "signed distance to a closed mesh",
     "properties": {
      "type": {
       "const": "mesh"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "file": {
       "type": "string"
      },
      "voxel": {
       "type": "number",
       "exclusiveMinimum": 0
      }
     },
     "required": [
      "type",
      "file"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "a level set in a .vdb file",
     "properties": {
      "type": {
       "const": "grid"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "file": {
       "type": "string"
      }
     },
     "required": [
      "type",
      "file"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "point-set surface of a cloud, or an .msurf",
     "properties": {
      "type": {
       "const": "points"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "file": {
       "type": "string"
      }
     },
     "required": [
      "type",
      "file"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "compact blobs about particles",
     "properties": {
      "type": {
       "const": "particles"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "file": {
       "type": "string"
      },
      "radius": {
       "type": "number",
       "exclusiveMinimum": 0
      },
      "frame": {
       "type": "integer",
       "minimum": 0
      }
     },
     "required": [
      "type",
      "file"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "least of the inputs",
     "properties": {
      "type": {
       "const": "union"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "inputs": {
       "type": "array",
       "minItems": 1,
       "items": {
        "$ref": "#/definitions/surface"
       }
      }
     },
     "required": [
      "type",
      "inputs"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "greatest of the inputs",
     "properties": {
      "type": {
       "const": "intersection"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "inputs": {
       "type": "array",
       "minItems": 1,
       "items": {
        "$ref": "#/definitions/surface"
       }
      }
     },
     "required": [
      "type",
      "inputs"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "the first input less the others",
     "properties": {
      "type": {
       "const": "difference"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "inputs": {
       "type": "array",
       "minItems": 1,
       "items": {
        "$ref": "#/definitions/surface"
       }
      }
     },
     "required": [
      "type",
      "inputs"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "union with a smooth joint of width k",
     "properties": {
      "type": {
       "const": "blend"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "inputs": {
       "type": "array",
       "minItems": 1,
       "items": {
        "$ref": "#/definitions/surface"
       }
      },
      "k": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "inputs",
      "k"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "grown by distance",
     "properties": {
      "type": {
       "const": "offset"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "input": {
       "$ref": "#/definitions/surface"
      },
      "distance": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "input",
      "distance"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "a wall about the surface",
     "properties": {
      "type": {
       "const": "shell"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "input": {
       "$ref": "#/definitions/surface"
      },
      "thickness": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "input",
      "thickness"
     ],
     "additionalProperties": false
    },
    {
     "type": "object",
     "description": "rotate in degrees about x, then y, then z; then scale; then translate",
     "properties": {
      "type": {
       "const": "transform"
      },
      "id": {
       "type": "string"
      },
      "extras": {},
      "freeze": {
       "type": "array",
       "items": {
        "type": "string"
       },
       "description": "paths of numbers below this node that are not unknowns"
      },
      "input": {
       "$ref": "#/definitions/surface"
      },
      "translate": {
       "$ref": "#/definitions/vector"
      },
      "rotate": {
       "$ref": "#/definitions/vector"
      },
      "scale": {
       "$ref": "#/definitions/number"
      }
     },
     "required": [
      "type",
      "input"
     ],
     "additionalProperties": false
    }
   ]
  }
 }
}
)schema";
}

}  // namespace meniscus::scene
