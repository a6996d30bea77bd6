# The first comment of a header becomes the description of the file; numbers of later lines stay as they are.
1s,^// ([^ ]+) -- (.*),/// @file \1\n/// \2,
2,/^[^\/]/s,^// ,/// ,
/^#pragma once$/d
# No link to something of that name.
/\/\/\//s/([^\\a-zA-Z&])#([a-z])/\1\\#\2/g
