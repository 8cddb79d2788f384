from .controls import controls as controls
from .design import Design as Design
from .design import Document as Document
from .design import opened as opened
from .design import save as save
from .server import Studio as Studio
from .server import serve as serve
