autocmd BufRead,BufNewFile *.ava setfiletype avastra
